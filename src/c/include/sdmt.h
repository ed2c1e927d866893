// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stddef.h>
#include <stdint.h>

/// SDMT for C99 and for every language that calls C: libsdmt.so.0, `pkg-config sdmt`.
///
///   sdmt_error* error = sdmt_error_new();
///   sdmt_model* model = sdmt_model_load("sdmt-lite.safetensors", error);
///   sdmt_tracker* tracker = sdmt_tracker_new(NULL, model, error);
///   if (tracker == NULL) puts(sdmt_error_text(error));
///
/// Handles. sdmt_X_new, _load and _read give a handle, or NULL when they fail; sdmt_X_free takes
/// it back and takes NULL too. Handles may be freed in any order: a tracker keeps the model that
/// it needs.
///
/// Errors. What can fail returns an sdmt_status, or a handle that is NULL, and writes one line
/// into the sdmt_error that it was given, which may be NULL. Nothing throws through this
/// interface, prints or exits. A call that fails changes nothing.
///
/// Threads. A model may be used by any number of threads at once; every other handle by one at a
/// time. Inside, embedding uses the threads of OpenMP.
///
/// Stability. Within libsdmt.so.0 functions and structs stay as they are; a struct with `size`
/// first may grow at its end.

#define SDMT_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/// As the exit codes of the command line.
typedef int sdmt_status;
enum {
  SDMT_OK = 0,
  SDMT_FAILED = 1,            ///< while running: memory, files
  SDMT_INVALID_ARGUMENT = 2,  ///< what the caller or a file gave; the text says what was expected
};

/// "0.1.0"
SDMT_API const char* sdmt_version(void);

/// The text of the last error. One for each thread.
typedef struct sdmt_error sdmt_error;
SDMT_API sdmt_error* sdmt_error_new(void);
SDMT_API void sdmt_error_free(sdmt_error* error);
/// One line; "" after a call that succeeded. Holds until the next call that is given `error`.
SDMT_API const char* sdmt_error_text(const sdmt_error* error);
/// Status of the last call that was given `error`.
SDMT_API sdmt_status sdmt_error_status(const sdmt_error* error);

/// Left, top, width and height in pixels; the first pixel is 1, as in MOTChallenge's files.
typedef struct {
  double left, top, width, height;
} sdmt_box;

/// A box and the detector's score: a probability, unless the option "calibration" maps it to one.
typedef struct {
  sdmt_box box;
  double score;
} sdmt_detection;

/// Order of the three channels in memory.
enum { SDMT_BGR = 0, SDMT_RGB = 1 };

/// Pixels of the caller's, 8 bits, three channels interleaved. They are looked at during the call
/// only, and not copied but for the crops.
typedef struct {
  const uint8_t* data;
  int width, height;  ///< pixels, > 0
  ptrdiff_t stride;   ///< bytes from a row to the next, >= 3 * width
  int order;          ///< SDMT_BGR or SDMT_RGB
} sdmt_image;

// --- The network that knows people ---

typedef struct sdmt_model sdmt_model;
/// Reads a model file (.safetensors). Many trackers and embedders can share one model.
SDMT_API sdmt_model* sdmt_model_load(const char* path, sdmt_error* error);
SDMT_API void sdmt_model_free(sdmt_model* model);
/// Values of an embedding.
SDMT_API int sdmt_model_dimension(const sdmt_model* model);
/// The stored threshold: two crops show one person when 1 - distance exceeds it. NaN: none stored.
SDMT_API double sdmt_model_tau_a(const sdmt_model* model);

typedef struct sdmt_embedder sdmt_embedder;
SDMT_API sdmt_embedder* sdmt_embedder_new(const sdmt_model* model, sdmt_error* error);
SDMT_API void sdmt_embedder_free(sdmt_embedder* embedder);
/// Embeds `count` boxes of an image. `vectors` takes count * sdmt_model_dimension() floats, row
/// after row, each of length 1; `valid` takes count bytes, 0 where a box lies outside the image
/// and its row is 0.
SDMT_API sdmt_status sdmt_embedder_describe(sdmt_embedder* embedder, const sdmt_image* image,
                                            const sdmt_box* boxes, size_t count, float* vectors,
                                            uint8_t* valid, sdmt_error* error);

// --- The tracker ---

/// Options of the tracker under their names on the command line (`sdmt track --help`).
typedef struct sdmt_options sdmt_options;
/// The defaults: the preset `tuned`.
SDMT_API sdmt_options* sdmt_options_new(sdmt_error* error);
SDMT_API void sdmt_options_free(sdmt_options* options);
/// sdmt_options_set(options, "min-iou", "0.3", error); switches take "true" and "false".
SDMT_API sdmt_status sdmt_options_set(sdmt_options* options, const char* name, const char* value,
                                      sdmt_error* error);

typedef struct sdmt_tracker sdmt_tracker;
/// `options`: NULL for the defaults. `model`: tells people apart; NULL: by motion alone.
SDMT_API sdmt_tracker* sdmt_tracker_new(const sdmt_options* options, const sdmt_model* model,
                                        sdmt_error* error);
/// People are told apart by vectors that come with the boxes (sdmt_input.embeddings). The options
/// must give "tau-a", the threshold of the network that makes them.
SDMT_API sdmt_tracker* sdmt_tracker_new_embedded(const sdmt_options* options, sdmt_error* error);
SDMT_API void sdmt_tracker_free(sdmt_tracker* tracker);

/// What is seen in a frame. Begin with `sdmt_input input = {sizeof input};`.
typedef struct {
  size_t size;  ///< sizeof(sdmt_input): which fields the caller knows of
  const sdmt_detection* detections;
  size_t count;             ///< of detections, may be 0
  const sdmt_image* image;  ///< NULL: there is none, the frame is tracked by motion
  /// [count, dimension], for sdmt_tracker_new_embedded(); scaled to length 1. Else NULL.
  const float* embeddings;
  size_t dimension;
  /// Seconds on any clock, which must rise: with the option "frame-rate" frames may come
  /// irregularly or not at all. NULL: the frame is one after the last.
  const double* time;
} sdmt_input;

/// Takes the next frame. Call it for every frame, also for those without detections. Frames that
/// are finished by it can then be had from sdmt_tracker_finished().
SDMT_API sdmt_status sdmt_tracker_update(sdmt_tracker* tracker, const sdmt_input* input,
                                         sdmt_error* error);
/// The next frame, at which no detector looked: people move on as predicted, and nobody misses a
/// detection. `time` as in sdmt_input.
SDMT_API sdmt_status sdmt_tracker_skip(sdmt_tracker* tracker, const double* time,
                                       sdmt_error* error);

/// How the picture moved since the frame before because the camera did: a point (x, y) of that
/// frame is at (a x - b y + tx, b x + a y + ty) in this one; a shift, a zoom and a roll. In pixels,
/// of which the first begins at 0. {1, 0, 0, 0} is a camera that stands still.
typedef struct {
  double a, b, tx, ty;
} sdmt_camera_motion;
/// sdmt_tracker_update() for a camera that moves: everything that the tracker knows moves along,
/// and boxes are reported where they are in their own frame. `camera` NULL: it stood still. Shifts
/// beyond 1e6 pixels and zooms beyond 0.1..10 are refused.
SDMT_API sdmt_status sdmt_tracker_update_moving(sdmt_tracker* tracker, const sdmt_input* input,
                                                const sdmt_camera_motion* camera,
                                                sdmt_error* error);
/// sdmt_tracker_skip() for a camera that moves.
SDMT_API sdmt_status sdmt_tracker_skip_moving(sdmt_tracker* tracker, const double* time,
                                              const sdmt_camera_motion* camera, sdmt_error* error);

/// Everything that the tracker knows: one made alike that restores it goes on with the same output,
/// in another process or on another machine. `size` says how many bytes `bytes` takes and gets how
/// many there are; with NULL for `bytes` only that. SDMT_INVALID_ARGUMENT when they do not fit.
SDMT_API sdmt_status sdmt_tracker_save(const sdmt_tracker* tracker, uint8_t* bytes, size_t* size,
                                       sdmt_error* error);
/// Refuses bytes that sdmt_tracker_save() did not make, other options and another appearance.
SDMT_API sdmt_status sdmt_tracker_restore(sdmt_tracker* tracker, const uint8_t* bytes, size_t size,
                                          sdmt_error* error);
/// The end of the input: all frames still held back are finished. Only
/// sdmt_tracker_finished() and sdmt_tracker_free() may follow.
SDMT_API sdmt_status sdmt_tracker_finish(sdmt_tracker* tracker, sdmt_error* error);

/// A frame about which the tracker will not change its mind.
typedef struct sdmt_frame sdmt_frame;
/// Number of frames that the last update or finish finished.
SDMT_API size_t sdmt_tracker_finished(const sdmt_tracker* tracker);
/// The i-th of them, in order; NULL beyond the last. Holds until the next update or finish.
SDMT_API const sdmt_frame* sdmt_tracker_frame(const sdmt_tracker* tracker, size_t i);

enum { SDMT_DETECTED = 0, SDMT_BOOSTED = 1, SDMT_INTERPOLATED = 2 };
/// A person in a finished frame.
typedef struct {
  int id;      ///< 1-based
  int source;  ///< where the box comes from: SDMT_DETECTED, ...
  sdmt_box box;
  double score;  ///< of the detection; 0 for boxes of other sources
} sdmt_track;
/// From this frame on the person known as `from` is reported as `to`.
typedef struct {
  int from, to;
} sdmt_merge;

/// 1-based, in the order of the updates, none missing.
SDMT_API int sdmt_frame_number(const sdmt_frame* frame);
/// The people, by id; `count` gets their number. Hold as the frame does.
SDMT_API const sdmt_track* sdmt_frame_tracks(const sdmt_frame* frame, size_t* count);
/// Merges of ids that were reported before this frame; rare with the default delay.
SDMT_API const sdmt_merge* sdmt_frame_merges(const sdmt_frame* frame, size_t* count);

// --- Files of boxes, and scores ---

typedef struct sdmt_detections sdmt_detections;
/// Reads boxes as `sdmt track --detections` does. `format`: "mot", "csv", "jsonl", "kitti", "coco"
/// or NULL, which finds it out.
SDMT_API sdmt_detections* sdmt_detections_read(const char* path, const char* format,
                                               sdmt_error* error);
SDMT_API void sdmt_detections_free(sdmt_detections* detections);
/// The largest frame number; 0 without boxes.
SDMT_API int sdmt_detections_last_frame(const sdmt_detections* detections);
/// 0 when all boxes have one score, which then says nothing: set the option "scores" to "false".
SDMT_API int sdmt_detections_have_scores(const sdmt_detections* detections);
/// Boxes of a frame, counted from 1; `count` gets their number. Holds as long as the handle.
SDMT_API const sdmt_detection* sdmt_detections_frame(const sdmt_detections* detections, int frame,
                                                     size_t* count);

typedef struct sdmt_evaluation sdmt_evaluation;
/// `benchmark`: whose rules, "MOT15", "MOT16", "MOT17" or "MOT20". `compat`: "trackeval" or
/// "devkit".
SDMT_API sdmt_evaluation* sdmt_evaluation_new(const char* benchmark, const char* compat,
                                              sdmt_error* error);
SDMT_API void sdmt_evaluation_free(sdmt_evaluation* evaluation);
/// Scores a file of MOTChallenge result rows against the ground truth of a sequence folder.
SDMT_API sdmt_status sdmt_evaluation_add(sdmt_evaluation* evaluation, const char* sequence,
                                         const char* results, sdmt_error* error);
/// For sdmt_evaluation_score(): all sequences as one.
enum { SDMT_COMBINED = -1 };
/// A score under TrackEval's name ("HOTA", "MOTA", "IDF1", "IDSW", ...); ratios are fractions.
/// `sequence`: in the order they were added, or SDMT_COMBINED.
SDMT_API sdmt_status sdmt_evaluation_score(const sdmt_evaluation* evaluation, int sequence,
                                           const char* name, double* score, sdmt_error* error);

#ifdef __cplusplus
}
#endif
