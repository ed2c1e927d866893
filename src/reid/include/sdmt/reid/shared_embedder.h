// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/reid/embedder.h"

namespace sdmt::reid {

/// One embedder for several trackers that run in threads of their own, as those of many cameras:
/// crops that wait at the same time go through the network as one batch, and what lies between its
/// layers is in memory once. The rows are those that an Embedder of its own would give, whoever
/// else asks.
///
///     SharedEmbedder shared(std::make_shared<const Model>(load_model(path)), 4);
///     // in each thread:
///     const auto appearance = shared.client();
///     track::Tracker tracker(options, appearance.get());
///
/// A client waits for those before it: trackers whose frames must not wait for others' take
/// embedders of their own, on one model.
class SharedEmbedder {
 public:
  /// The network runs in a thread of this object, with so many of OpenMP's threads, >= 1. Throws as
  /// Embedder does, and std::system_error where no thread can be started.
  SharedEmbedder(std::shared_ptr<const Model> model, int threads,
                 const EmbedderOptions& options = {});
  /// All clients must be gone.
  ~SharedEmbedder();

  /// One for each tracker; may be called by any thread. A client serves one thread at a time, and
  /// throws what an Embedder would throw of its own crops, not of others'.
  std::unique_ptr<image::CropDescriptor> client();

 private:
  class Client;
  struct Request;

  void ask(Request& request);
  void work(int threads);
  void serve(const std::vector<Request*>& batch);
  void describe_together(const std::vector<Request*>& batch);

  Embedder embedder_;
  std::mutex mutex_;
  std::condition_variable asked_, answered_;
  std::vector<Request*> waiting_;
  bool ending_ = false;
  std::thread worker_;  // the last: it uses all others
};

}  // namespace sdmt::reid
