// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target without a fuzzing engine: on its seeds and on random variants of them. Every build thus
// checks the parsers, even without clang; tools/fuzz searches for more, from the seeds that this program
// writes.

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/seeds.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr std::size_t kMaxLength = 4096;

void runOn(const std::string& bytes) {
  // from the heap and without a NUL behind it, so that a sanitizer sees a read past the end
  const std::vector<std::uint8_t> input(bytes.begin(), bytes.end());
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

/// Applies one to four changes: a flipped bit, a changed byte, a truncation, an extension, a moved piece.
std::string variantOf(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t kind = below(5);
    if (bytes.empty() || kind == 3) {
      if (bytes.size() < kMaxLength) bytes.append(1 + below(64), static_cast<char>(below(256)));
      continue;
    }
    const std::size_t at = below(bytes.size());
    if (kind == 0) bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << below(8)));
    if (kind == 1) bytes[at] = static_cast<char>(below(256));
    if (kind == 2) bytes.resize(at);
    if (kind == 4) {
      bytes.insert(below(at + 1), bytes.substr(at));
      bytes.resize(std::min(bytes.size(), kMaxLength));
    }
  }
  return bytes;
}

int runVariants(std::size_t count) {
  const std::vector<std::string> begin = seeds();
  std::mt19937 random(1);
  runOn({});
  for (const std::string& seed : begin) runOn(seed);
  for (std::size_t i = 0; i < count; ++i) runOn(variantOf(begin[i % begin.size()], random));
  std::printf("%zu seeds, %zu variants\n", begin.size(), count);
  return EXIT_SUCCESS;
}

int writeSeeds(const std::filesystem::path& folder) {
  std::size_t number = 0;
  for (const std::string& seed : seeds()) {
    std::ofstream file(folder / ("seed-" + std::to_string(number++)), std::ios::binary);
    if (!(file << seed << std::flush)) return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && argv[1] == std::string_view("--write")) return writeSeeds(argv[2]);
  std::size_t variants = 0;
  const std::string_view text = argc == 2 ? argv[1] : "";
  if (std::from_chars(text.data(), text.data() + text.size(), variants).ec == std::errc{})
    return runVariants(variants);
  std::fprintf(stderr, "usage: %s VARIANTS | --write FOLDER\n", argv[0]);
  return EXIT_FAILURE;
}
