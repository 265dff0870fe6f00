// SPDX-License-Identifier: Apache-2.0
// A listener that a test stops: `deaf-listener DOMAIN TOPIC` of forces, or of points where the topic ends
// with that word. Prints "hears" once a message has come.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "ros_messages.h"
#include "tests/ros/ros_listener.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  hapticd::test::RosListener listener(std::atoi(argv[1]));
  listener.subscribe(argv[2], std::string_view(argv[2]).ends_with("/points")
                                  ? sensor_msgs_msg_dds__PointCloud2__desc
                                  : geometry_msgs_msg_dds__WrenchStamped__desc);
  for (bool hears = false;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const bool has_come = !listener.take(argv[2]).empty();
    if (!has_come || hears) continue;
    hears = true;
    std::puts("hears");
    std::fflush(stdout);
  }
}
