// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mpi/mpi_group.h"

#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "reduction.h"
#include "requests.h"

namespace sdmt::mpi {

namespace {

constexpr int kGatherTag = 1;
constexpr int kBroadcastTag = 2;
constexpr int kFailureTag = 3;
constexpr int kFirstReductionTag = 16;
constexpr int kLastReductionTag = 32000;  // MPI promises 32767

/// How long to sleep between looks at what has arrived: not at all at first, then longer, so that
/// who computes has the core.
class Patience {
 public:
  void wait() {
    using namespace std::chrono_literals;
    ++looks_;
    if (looks_ < 20) {
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(looks_ < 200 ? 50us : 500us);
    }
  }

 private:
  int looks_ = 0;
};

}  // namespace

struct MpiGroup::State {
  int rank = 0;
  int size = 1;
  std::string host;
  bool left = false;

  std::mutex mutex;  // of MPI and of all below
  std::condition_variable changed;
  std::list<Reduction> reductions;
  int tag = kFirstReductionTag;
  std::int64_t bytes_sent = 0;
  std::string failure;
  bool ended = false;
  std::thread thread;

  /// Goes on with the reductions, under the lock. What fails is kept for the caller's thread.
  void advance() {
    if (!failure.empty()) return;
    try {
      std::erase_if(reductions, [this](Reduction& reduction) {
        if (!reduction.advance()) return false;
        bytes_sent += reduction.bytes_sent();
        return true;
      });
      if (rank == 0) look_for_failures();
    } catch (const std::exception& error) {
      failure = error.what();
    }
  }

  void look_for_failures() {
    int found = 0;
    MPI_Status status;
    check(MPI_Iprobe(MPI_ANY_SOURCE, kFailureTag, MPI_COMM_WORLD, &found, &status));
    if (found == 0) return;
    int size_of_message = 0;
    check(MPI_Get_count(&status, MPI_CHAR, &size_of_message));
    std::string message(static_cast<std::size_t>(size_of_message), ' ');
    check(MPI_Recv(message.data(), size_of_message, MPI_CHAR, status.MPI_SOURCE, kFailureTag,
                   MPI_COMM_WORLD, MPI_STATUS_IGNORE));
    failure = message;
  }

  /// Waits until done() under the lock says so.
  template <class Done>
  void wait_until(const Done& done) {
    Patience patience;
    for (;;) {
      {
        const std::scoped_lock lock(mutex);
        advance();
        if (!failure.empty()) throw std::runtime_error(failure);
        if (done()) return;
      }
      patience.wait();
    }
  }

  void finish(Requests& requests) {
    wait_until([&] { return requests.done(); });
    const std::scoped_lock lock(mutex);
    bytes_sent += requests.bytes_sent();
  }

  void run() {
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex);
    while (!ended) {
      if (reductions.empty()) {
        changed.wait(lock);
        continue;
      }
      advance();
      lock.unlock();
      std::this_thread::sleep_for(200us);
      lock.lock();
    }
  }
};

std::unique_ptr<MpiGroup> MpiGroup::join() {
  int provided = MPI_THREAD_SINGLE;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided) != MPI_SUCCESS ||
      provided < MPI_THREAD_SERIALIZED) {
    throw std::runtime_error("MPI cannot be used by several threads, one at a time");
  }
  auto state = std::make_unique<State>();
  check(MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN));
  check(MPI_Comm_rank(MPI_COMM_WORLD, &state->rank));
  check(MPI_Comm_size(MPI_COMM_WORLD, &state->size));
  char name[MPI_MAX_PROCESSOR_NAME] = {};
  int length = 0;
  check(MPI_Get_processor_name(name, &length));
  state->host.assign(name, static_cast<std::size_t>(length));
  return std::unique_ptr<MpiGroup>(new MpiGroup(std::move(state)));
}

MpiGroup::MpiGroup(std::unique_ptr<State> state)
    : ProcessGroup(state->rank, state->size), state_(std::move(state)) {
  state_->thread = std::thread([this] { state_->run(); });
}

MpiGroup::~MpiGroup() {
  {
    const std::scoped_lock lock(state_->mutex);
    state_->ended = true;
    state_->changed.notify_one();
  }
  state_->thread.join();
  if (state_->left) MPI_Finalize();
}

void MpiGroup::gather(std::span<std::byte> bytes, std::span<const std::size_t> bounds) {
  Requests requests;
  const auto part = [&](int r) { return bytes.subspan(bounds[r], bounds[r + 1] - bounds[r]); };
  {
    const std::scoped_lock lock(state_->mutex);
    for (int step = 1; step < size(); ++step) {
      const int to = (rank() + step) % size();
      const int from = (rank() + size() - step) % size();
      requests.receive(part(from), from, kGatherTag);
      requests.send(part(rank()), to, kGatherTag);
    }
  }
  state_->finish(requests);
}

void MpiGroup::broadcast(std::span<std::byte> bytes) {
  Requests requests;
  {
    const std::scoped_lock lock(state_->mutex);
    if (rank() > 0) {
      requests.receive(bytes, 0, kBroadcastTag);
    } else {
      for (int to = 1; to < size(); ++to) requests.send(bytes, to, kBroadcastTag);
    }
  }
  state_->finish(requests);
}

void MpiGroup::reduce(std::span<const float> nodes, std::vector<std::span<float>> sums) {
  const std::scoped_lock lock(state_->mutex);
  if (!state_->failure.empty()) throw std::runtime_error(state_->failure);
  state_->reductions.emplace_back(rank(), size(), state_->tag, nodes, std::move(sums));
  state_->tag += 2;
  if (state_->tag > kLastReductionTag) state_->tag = kFirstReductionTag;
  state_->changed.notify_one();
}

void MpiGroup::wait() {
  state_->wait_until([this] { return state_->reductions.empty(); });
}

void MpiGroup::leave() {
  wait();
  std::vector<std::byte> all(static_cast<std::size_t>(size()));
  std::vector<std::size_t> bounds;
  for (int r = 0; r <= size(); ++r) bounds.push_back(static_cast<std::size_t>(r));
  gather(all, bounds);
  state_->left = true;
}

void MpiGroup::fail(std::string_view message) noexcept {
  if (rank() == 0) return;
  try {
    const std::scoped_lock lock(state_->mutex);
    const std::string text =
        "process " + std::to_string(rank()) + " on " + host() + ": " + std::string(message);
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Isend(text.data(), static_cast<int>(text.size()), MPI_CHAR, 0, kFailureTag, MPI_COMM_WORLD,
              &request);
    MPI_Wait(&request, MPI_STATUS_IGNORE);
  } catch (...) {
    return;
  }
}

const std::string& MpiGroup::host() const { return state_->host; }

std::int64_t MpiGroup::bytes_sent() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->bytes_sent;
}

}  // namespace sdmt::mpi
