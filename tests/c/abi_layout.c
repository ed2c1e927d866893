/* SPDX-License-Identifier: Apache-2.0 */
/* Prints how the structs and constants of sdmt.h look in memory. */
#include <sdmt.h>
#include <stdio.h>

#define STRUCT(type) printf("%s: %u bytes\n", #type, (unsigned)sizeof(type))
#define FIELD(type, field)                                                        \
  printf("%s.%s: %u, %u bytes\n", #type, #field, (unsigned)offsetof(type, field), \
         (unsigned)sizeof(((type*)0)->field))
#define CONSTANT(name) printf("%s = %d\n", #name, name)

int main(void) {
  STRUCT(sdmt_box);
  FIELD(sdmt_box, left);
  FIELD(sdmt_box, top);
  FIELD(sdmt_box, width);
  FIELD(sdmt_box, height);
  STRUCT(sdmt_detection);
  FIELD(sdmt_detection, box);
  FIELD(sdmt_detection, score);
  STRUCT(sdmt_image);
  FIELD(sdmt_image, data);
  FIELD(sdmt_image, width);
  FIELD(sdmt_image, height);
  FIELD(sdmt_image, stride);
  FIELD(sdmt_image, order);
  STRUCT(sdmt_input);
  FIELD(sdmt_input, size);
  FIELD(sdmt_input, detections);
  FIELD(sdmt_input, count);
  FIELD(sdmt_input, image);
  FIELD(sdmt_input, embeddings);
  FIELD(sdmt_input, dimension);
  FIELD(sdmt_input, time);
  STRUCT(sdmt_track);
  FIELD(sdmt_track, id);
  FIELD(sdmt_track, source);
  FIELD(sdmt_track, box);
  FIELD(sdmt_track, score);
  STRUCT(sdmt_merge);
  FIELD(sdmt_merge, from);
  FIELD(sdmt_merge, to);
  STRUCT(sdmt_camera_motion);
  FIELD(sdmt_camera_motion, a);
  FIELD(sdmt_camera_motion, b);
  FIELD(sdmt_camera_motion, tx);
  FIELD(sdmt_camera_motion, ty);
  CONSTANT(SDMT_OK);
  CONSTANT(SDMT_FAILED);
  CONSTANT(SDMT_INVALID_ARGUMENT);
  CONSTANT(SDMT_BGR);
  CONSTANT(SDMT_RGB);
  CONSTANT(SDMT_DETECTED);
  CONSTANT(SDMT_BOOSTED);
  CONSTANT(SDMT_INTERPOLATED);
  CONSTANT(SDMT_COMBINED);
  return 0;
}
