// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "sdmt.h"

struct sdmt_error {
  std::string text;
  const char* shown = "";  // text, or a literal where there was no memory for it
  sdmt_status status = SDMT_OK;

  sdmt_status set(sdmt_status new_status, const char* message) noexcept {
    status = new_status;
    try {
      text = message;
      shown = text.c_str();
    } catch (...) {
      shown = "out of memory";
    }
    return status;
  }
};

namespace sdmt::c {

/// Does the work of a function of the interface: what is thrown ends here.
template <typename Work>
sdmt_status guarded(sdmt_error* error, Work work) noexcept {
  sdmt_error unwanted;
  sdmt_error& report = error != nullptr ? *error : unwanted;
  try {
    work();
    return report.set(SDMT_OK, "");
  } catch (const std::logic_error& wrong) {
    return report.set(SDMT_INVALID_ARGUMENT, wrong.what());
  } catch (const std::bad_alloc&) {
    return report.set(SDMT_FAILED, "out of memory");
  } catch (const std::exception& failure) {
    return report.set(SDMT_FAILED, failure.what());
  } catch (...) {
    return report.set(SDMT_FAILED, "unknown failure");
  }
}

/// The same for functions that give a handle.
template <typename Make>
auto guarded_new(sdmt_error* error, Make make) noexcept {
  decltype(make()) handle = nullptr;
  guarded(error, [&] { handle = make(); });
  return handle;
}

/// Throws std::invalid_argument for a null pointer.
template <typename Value>
Value& given(Value* pointer, const char* name) {
  if (pointer == nullptr) throw std::invalid_argument(std::string(name) + " is NULL");
  return *pointer;
}

}  // namespace sdmt::c
