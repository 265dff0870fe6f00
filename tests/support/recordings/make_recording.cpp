// SPDX-License-Identifier: Apache-2.0
// make-recording SCENE FRAMES FOLDER: writes a synthetic recording.

#include <charconv>
#include <cstdio>
#include <exception>
#include <string>

#include "tests/support/recordings/recording.h"

int main(int argc, char** argv) {
  using namespace hapticd::test;
  const auto scene = argc == 4 ? madeUpSceneFrom(argv[1]) : std::nullopt;
  const std::string number = argc == 4 ? argv[2] : "";
  std::uint32_t frames = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), frames);
  if (!scene || error != std::errc{} || end != number.data() + number.size() || frames == 0 ||
      frames > 2000) {
    std::fputs(
        "usage: make-recording room|gesture|desk FRAMES FOLDER    (1 to 2000 frames, a folder that exists)\n",
        stderr);
    return 2;
  }
  try {
    makeRecording(*scene, frames, argv[3]);
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "make-recording: %s\n", problem.what());
    return 1;
  }
  return 0;
}
