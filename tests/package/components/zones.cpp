// SPDX-License-Identifier: Apache-2.0
#include <sdmt/zones/zone_counter.h>

#include <cstdio>

int main() {
  const auto plan = sdmt::zones::parse_zone_plan(
      R"({"lines": [{"name": "door", "from": [10, 50], "to": [90, 50]}]})", "plan");
  sdmt::zones::ZoneCounter counter(plan);
  counter.add({1, {{1, {40, 10, 20, 20}}}, {}}, 0);
  counter.add({2, {{1, {40, 50, 20, 20}}}, {}}, 1);
  std::printf("%d in\n", static_cast<int>(counter.lines()[0].in));
}
