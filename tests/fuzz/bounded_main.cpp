// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target without a fuzzing engine: on every file of the corpus and on random variants of each.
// Every build thus checks the parsers, even without clang; tools/fuzz searches for more.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kVariantsPerFile = 2'000;
constexpr std::size_t kLongest = 4096;

void runOn(const Bytes& bytes) {
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

/// Applies one to four changes: a flipped bit, a changed byte, a truncation, an extension, a moved piece.
Bytes variantOf(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t kind = below(5);
    if (bytes.empty() || kind == 3) {
      if (bytes.size() < kLongest)
        bytes.insert(bytes.end(), 1 + below(64), static_cast<std::uint8_t>(below(256)));
      continue;
    }
    const std::size_t at = below(bytes.size());
    if (kind == 0) bytes[at] ^= static_cast<std::uint8_t>(1U << below(8));
    if (kind == 1) bytes[at] = static_cast<std::uint8_t>(below(256));
    if (kind == 2) bytes.resize(at);
    if (kind == 4) {
      const Bytes piece(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
      bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(at + 1)), piece.begin(), piece.end());
      bytes.resize(std::min(bytes.size(), kLongest));
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || !std::filesystem::is_directory(argv[1])) {
    std::fprintf(stderr, "usage: %s CORPUS_FOLDER\n", argv[0]);
    return EXIT_FAILURE;
  }
  std::mt19937 random(1);
  int files = 0;
  runOn({});
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    std::ifstream stream(entry.path(), std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(stream), {}};
    runOn(bytes);
    for (int i = 0; i < kVariantsPerFile; ++i) runOn(variantOf(bytes, random));
    ++files;
  }
  std::printf("%d files, %d variants of each\n", files, kVariantsPerFile);
  return files > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
