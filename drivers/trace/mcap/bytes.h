// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace hapticd::drivers::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied in the file's own byte order");

/// Appends little-endian numbers, and texts preceded by their lengths, as in MCAP.
class ByteWriter {
 public:
  explicit ByteWriter(std::string& to) : to_(to) {}

  template <std::unsigned_integral Number>
  void number(Number value) {
    to_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void raw(std::string_view bytes) { to_.append(bytes); }
  void text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    raw(text);
  }
  /// Appends the output of `fill`, preceded by its length in bytes.
  template <std::unsigned_integral Length, typename Fill>
  void sized(Fill fill) {
    const std::size_t at = to_.size();
    number(Length{0});
    fill();
    const auto length = static_cast<Length>(to_.size() - at - sizeof(Length));
    std::memcpy(to_.data() + at, &length, sizeof length);
  }

 private:
  std::string& to_;
};

/// Reads little-endian numbers, and texts preceded by their lengths. Reading beyond the end makes good()
/// false and returns empty values.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <std::unsigned_integral Number>
  Number number() {
    Number value{};
    const std::string_view bytes = raw(sizeof value);
    if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view raw(std::uint64_t length) {
    if (length > rest_.size()) {
      good_ = false;
      rest_ = {};
    }
    const std::string_view bytes = rest_.substr(0, length);
    rest_.remove_prefix(bytes.size());
    return bytes;
  }
  /// Reads bytes preceded by their length.
  template <std::unsigned_integral Length>
  std::string_view sized() {
    return raw(number<Length>());
  }
  std::string_view text() { return sized<std::uint32_t>(); }

  bool good() const { return good_; }
  bool atEnd() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

}  // namespace hapticd::drivers::mcap
