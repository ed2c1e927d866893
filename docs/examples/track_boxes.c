/* SPDX-License-Identifier: Apache-2.0 */
/* Tracks the boxes of a file by motion and prints MOTChallenge result rows, as
   `sdmt track --no-appearance` writes them. C99; the same with pkg-config or CMake:

     cc track_boxes.c $(pkg-config --cflags --libs sdmt) -o track_boxes && ./track_boxes det.txt

     find_package(sdmt REQUIRED COMPONENTS c)
     target_link_libraries(track_boxes PRIVATE sdmt::c) */
#include <sdmt.h>
#include <stdio.h>

static int fail(const sdmt_error* error) {
  fprintf(stderr, "track_boxes: %s\n", sdmt_error_text(error));
  return sdmt_error_status(error);
}

static void print(const sdmt_tracker* tracker) {
  const sdmt_frame* frame;
  for (size_t i = 0; (frame = sdmt_tracker_frame(tracker, i)) != NULL; ++i) {
    size_t count;
    const sdmt_track* person = sdmt_frame_tracks(frame, &count);
    for (; count > 0; --count, ++person) {
      printf("%d,%d,%.2f,%.2f,%.2f,%.2f,%.6g,-1,-1,-1\n", sdmt_frame_number(frame), person->id,
             person->box.left, person->box.top, person->box.width, person->box.height,
             person->score);
    }
  }
}

int main(int argc, char** argv) {
  sdmt_error* error = sdmt_error_new();
  sdmt_detections* boxes = sdmt_detections_read(argc > 1 ? argv[1] : NULL, NULL, error);
  if (boxes == NULL) return fail(error);
  sdmt_options* options = sdmt_options_new(error);
  if (!sdmt_detections_have_scores(boxes)) sdmt_options_set(options, "scores", "false", error);
  sdmt_tracker* tracker = sdmt_tracker_new(options, NULL, error);
  if (tracker == NULL) return fail(error);

  for (int frame = 1; frame <= sdmt_detections_last_frame(boxes); ++frame) {
    sdmt_input input = {sizeof input, NULL, 0, NULL, NULL, 0, NULL};
    input.detections = sdmt_detections_frame(boxes, frame, &input.count);
    if (sdmt_tracker_update(tracker, &input, error) != SDMT_OK) return fail(error);
    print(tracker);
  }
  if (sdmt_tracker_finish(tracker, error) != SDMT_OK) return fail(error);
  print(tracker);

  sdmt_tracker_free(tracker);
  sdmt_options_free(options);
  sdmt_detections_free(boxes);
  sdmt_error_free(error);
  return 0;
}
