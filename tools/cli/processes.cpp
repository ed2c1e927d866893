// SPDX-License-Identifier: Apache-2.0
#include "cli/processes.h"

#include <fmt/core.h>
#include <gnu/libc-version.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "cli/console.h"
#include "cli/stop_signal.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/nn/simd_target.h"
#ifdef SDMT_HAS_MPI
#include "sdmt/mpi/mpi_group.h"
#endif

namespace sdmt::tools {

namespace {

int number_in_environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : io::parse_number<int>(text).value_or(otherwise);
}

// Open MPI, MPICH and its relatives, Slurm's steps.
constexpr std::array kSizes{"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"};
constexpr std::array kRanks{"OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"};

int launched_size() {
  for (const char* name : kSizes) {
    if (const int size = number_in_environment(name, 1); size > 1) return size;
  }
  return 1;
}

#ifdef SDMT_HAS_MPI

// What must be the same for sums, roots and exponentials to have the same bits.
std::string arithmetic() {
  return fmt::format("sdmt {} on {} with C library {}", SDMT_VERSION, nn::simd_target(),
                     gnu_get_libc_version());
}

void require_same_arithmetic(mpi::MpiGroup& group) {
  constexpr std::size_t kSize = 256;
  std::vector<char> texts(static_cast<std::size_t>(group.size()) * kSize, '\0');
  const auto text_of = [&](int rank) { return texts.data() + rank * kSize; };
  const std::string here = arithmetic() + " (" + group.host() + ")";
  here.copy(text_of(group.rank()), kSize - 1);
  std::vector<std::size_t> bounds;
  for (int rank = 0; rank <= group.size(); ++rank) bounds.push_back(rank * kSize);
  group.gather(std::as_writable_bytes(std::span(texts)), bounds);
  const auto arithmetic_of = [&](int rank) {
    const std::string text = text_of(rank);
    return text.substr(0, text.find(" ("));
  };
  for (int rank = 1; rank < group.size(); ++rank) {
    if (arithmetic_of(rank) == arithmetic_of(0)) continue;
    throw std::invalid_argument(fmt::format(
        "process {} is {}, process 0 is {}: their sums differ in the last bits; expected the same "
        "on all, the instruction set by the environment variable SDMT_SIMD (mpirun -x "
        "SDMT_SIMD=AVX2)",
        rank, text_of(rank), text_of(0)));
  }
}

#endif

}  // namespace

int launched_rank() {
  if (launched_size() == 1) return 0;
  for (const char* name : kRanks) {
    if (const int rank = number_in_environment(name, -1); rank >= 0) return rank;
  }
  return 0;
}

void let_launcher_pass_on() {
  if (launched_size() > 1) std::this_thread::sleep_for(std::chrono::milliseconds(500));
}

Processes::Processes() : group_(&nn::ProcessGroup::alone()) {
  const int size = launched_size();
  if (size == 1) return;
#ifdef SDMT_HAS_MPI
  auto joined = mpi::MpiGroup::join();
  auto& group = *joined;
  own_ = std::move(joined);
  group_ = &group;
  try {
    if (group.size() != size) {
      throw std::runtime_error(fmt::format(
          "started as one of {} processes, but MPI sees {}: expected the launcher of the "
          "MPI that sdmt was built with (srun --mpi=pmix for Open MPI)",
          size, group.size()));
    }
    require_same_arithmetic(group);
  } catch (const std::exception& error) {
    fail(error);
    throw;
  }
#else
  throw std::runtime_error(
      fmt::format("started as one of {} processes, but this sdmt was built without MPI: expected "
                  "one process, or a build with SDMT_BUILD_MPI",
                  size));
#endif
}

Processes::~Processes() = default;

bool Processes::any(bool here) const {
  if (group_->size() == 1) return here;
  std::vector<std::byte> flags(static_cast<std::size_t>(group_->size()));
  flags[group_->rank()] = std::byte{here};
  std::vector<std::size_t> bounds;
  for (std::size_t rank = 0; rank <= flags.size(); ++rank) bounds.push_back(rank);
  group_->gather(flags, bounds);
  return std::any_of(flags.begin(), flags.end(),
                     [](std::byte flag) { return flag != std::byte{}; });
}

std::int64_t Processes::bytes_sent() const {
#ifdef SDMT_HAS_MPI
  if (own_ != nullptr) return dynamic_cast<const mpi::MpiGroup&>(*own_).bytes_sent();
#endif
  return 0;
}

void Processes::leave() {
#ifdef SDMT_HAS_MPI
  if (own_ != nullptr) dynamic_cast<mpi::MpiGroup&>(*own_).leave();
#endif
}

void Processes::fail([[maybe_unused]] const std::exception& error) noexcept {
  if (group_->rank() == 0) return;
#ifdef SDMT_HAS_MPI
  // The first says it and ends, and the launcher ends the others. Who is not ended, because the
  // first is gone, ends by itself.
  constexpr int kTenths = 200;
  dynamic_cast<mpi::MpiGroup&>(*own_).fail(error.what());
  for (int tenth = 0; tenth < kTenths && received_stop_signal() == 0; ++tenth) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
#endif
}

}  // namespace sdmt::tools
