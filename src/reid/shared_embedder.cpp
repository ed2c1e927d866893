// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/shared_embedder.h"

#include <omp.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::reid {

/// What a client asks for, and waits for.
struct SharedEmbedder::Request {
  std::function<void(Embedder&)> alone;
  std::span<const image::Crop> crops;  // and their rows, where others' may be described with them
  image::DescriptorRows* rows = nullptr;
  bool described = false;
  std::exception_ptr error;
  bool answered = false;  // under the mutex
};

class SharedEmbedder::Client final : public image::CropDescriptor {
 public:
  explicit Client(SharedEmbedder& shared) : shared_(shared) {}

  std::string name() const override { return shared_.embedder_.name(); }
  int dimension() const override { return shared_.embedder_.dimension(); }
  std::optional<double> tau_a() const override { return shared_.embedder_.tau_a(); }

  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    Request request;
    request.crops = crops;
    request.alone = [&](Embedder& embedder) { embedder.describe(crops, out); };
    request.rows = &out;
    shared_.ask(request);
  }

  void describe_shifted(const image::ImageView& image, const image::PixelRect& window,
                        std::span<const image::GridShift> shifts,
                        image::DescriptorRows& out) override {
    Request request;
    request.alone = [&](Embedder& embedder) {
      embedder.describe_shifted(image, window, shifts, out);
    };
    shared_.ask(request);
  }

 private:
  SharedEmbedder& shared_;
};

SharedEmbedder::SharedEmbedder(std::shared_ptr<const Model> model, int threads,
                               const EmbedderOptions& options)
    : embedder_(std::move(model), options) {
  io::require(threads >= 1, "threads", threads, ">= 1");
  worker_ = std::thread([this, threads] { work(threads); });
}

SharedEmbedder::~SharedEmbedder() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  asked_.notify_one();
  worker_.join();
}

std::unique_ptr<image::CropDescriptor> SharedEmbedder::client() {
  return std::make_unique<Client>(*this);
}

void SharedEmbedder::ask(Request& request) {
  std::unique_lock lock(mutex_);
  waiting_.push_back(&request);
  asked_.notify_one();
  answered_.wait(lock, [&] { return request.answered; });
  if (request.error) std::rethrow_exception(request.error);
}

void SharedEmbedder::work(int threads) {
  omp_set_num_threads(threads);
  std::unique_lock lock(mutex_);
  while (true) {
    asked_.wait(lock, [&] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const auto batch = std::exchange(waiting_, {});
    lock.unlock();
    serve(batch);
    lock.lock();
    for (Request* request : batch) request->answered = true;
    answered_.notify_all();
  }
}

void SharedEmbedder::serve(const std::vector<Request*>& batch) {
  try {
    describe_together(batch);
  } catch (...) {  // whose crops are to blame, each finds out alone
  }
  for (Request* request : batch) {
    if (request->described) continue;
    try {
      request->alone(embedder_);
    } catch (...) {
      request->error = std::current_exception();
    }
  }
}

void SharedEmbedder::describe_together(const std::vector<Request*>& batch) {
  std::vector<image::Crop> crops;
  for (const Request* request : batch) {
    crops.insert(crops.end(), request->crops.begin(), request->crops.end());
  }
  image::DescriptorRows all;
  embedder_.describe(crops, all);
  std::size_t first = 0;
  for (Request* request : batch) {
    if (request->rows == nullptr) continue;
    image::DescriptorRows& rows = *request->rows;
    const std::size_t count = request->crops.size();
    rows.reset(count, all.dimension);
    for (std::size_t i = 0; i < count; ++i) {
      rows.valid[i] = all.valid[first + i];
      std::ranges::copy(all.row(first + i), rows.row(i).begin());
    }
    first += count;
    request->described = true;
  }
}

}  // namespace sdmt::reid
