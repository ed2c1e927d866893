// SPDX-License-Identifier: Apache-2.0
#include "guard.h"

const char* sdmt_version(void) { return SDMT_VERSION; }

sdmt_error* sdmt_error_new(void) { return new (std::nothrow) sdmt_error; }
void sdmt_error_free(sdmt_error* error) { delete error; }
const char* sdmt_error_text(const sdmt_error* error) {
  return error != nullptr ? error->shown : "";
}
sdmt_status sdmt_error_status(const sdmt_error* error) {
  return error != nullptr ? error->status : SDMT_OK;
}
