// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace hapticd::trace {

/// CDR as written by ROS 2: XCDR1, little-endian (OMG DDS-XTypes 1.3, 7.4). Numbers are aligned to their own
/// size, counted from the end of the header.
inline constexpr std::string_view kCdrHead{"\0\1\0\0", 4};

template <typename Number>
concept CdrNumber = std::is_arithmetic_v<Number>;

/// Appends one CDR message to a string.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& to) : to_(to) {
    to_.append(kCdrHead);
    begin_ = to_.size();
  }

  template <CdrNumber Number>
  void number(Number value) {
    align(sizeof value);
    to_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    to_.append(text).push_back('\0');
  }
  /// Appends a sequence of bytes.
  void bytes(std::string_view bytes) {
    number(static_cast<std::uint32_t>(bytes.size()));
    to_.append(bytes);
  }

 private:
  void align(std::size_t size) { to_.append((size - (to_.size() - begin_) % size) % size, '\0'); }

  std::string& to_;
  std::size_t begin_;
};

/// The order of bytes that a reader takes: that in which hapticd writes, or also the other one.
enum class CdrOrder : std::uint8_t { little_endian, any };

/// Reads one CDR message. Reading a missing or invalid value makes good() false and returns zero.
class CdrReader {
 public:
  explicit CdrReader(std::string_view message, CdrOrder order = CdrOrder::little_endian)
      : message_(message), swaps_(order == CdrOrder::any && message.starts_with(kBigEndianHead)) {
    good_ = swaps_ || message.starts_with(kCdrHead);
    message_.remove_prefix(good_ ? kCdrHead.size() : message_.size());
  }

  template <CdrNumber Number>
  Number number() {
    at_ += (sizeof(Number) - at_ % sizeof(Number)) % sizeof(Number);
    const std::string_view bytes = raw(sizeof(Number));
    Number value{};
    if constexpr (std::same_as<Number, bool>) {
      value = !bytes.empty() && bytes[0] == 1;
      good_ = good_ && (value || bytes[0] == 0);
    } else if (!bytes.empty()) {
      std::memcpy(&value, bytes.data(), sizeof value);
      if (swaps_) std::ranges::reverse(std::as_writable_bytes(std::span(&value, 1)));
    }
    return value;
  }
  std::string_view text() {
    const std::string_view text = bytes();
    good_ = good_ && text.ends_with('\0');
    return text.substr(0, text.size() - (good_ ? 1 : 0));
  }
  std::string_view bytes() { return raw(number<std::uint32_t>()); }

  bool good() const { return good_; }
  /// Returns true if everything has been read without error.
  bool complete() const { return good_ && at_ == message_.size(); }
  std::size_t left() const { return message_.size() - std::min(at_, message_.size()); }
  void refuse() { good_ = false; }
  /// Returns the read position, for seek().
  std::size_t place() const { return at_; }
  void seek(std::size_t place) { at_ = place; }

 private:
  std::string_view raw(std::size_t length) {
    if (!good_ || at_ > message_.size() || length > message_.size() - at_) {
      good_ = false;
      return {};
    }
    at_ += length;
    return message_.substr(at_ - length, length);
  }

  static constexpr std::string_view kBigEndianHead{"\0\0\0\0", 4};

  std::string_view message_;  // without its header
  std::size_t at_ = 0;
  bool swaps_;
  bool good_ = false;
};

}  // namespace hapticd::trace
