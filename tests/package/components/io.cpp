// SPDX-License-Identifier: Apache-2.0
#include <sdmt/io/delimited_text.h>
#include <sdmt/io/output_file.h>

#include <cstdio>

int main() {
  sdmt::io::write_text_file("consumer.txt", "written and read");
  std::puts(sdmt::io::read_text("consumer.txt").c_str());
}
