// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hapticd::tools::view {

/// What a client of the Foxglove protocol may ask for.
struct Subscribe {
  struct Item {
    std::uint32_t subscription = 0;  ///< the client's number for it
    std::uint32_t channel = 0;
  };
  std::vector<Item> items;
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct GetParameters {
  std::vector<std::string> names;  ///< empty: all
  std::optional<std::string> id;   ///< to be repeated in the answer

  /// What it takes in memory, at most: short texts take none beside themselves.
  std::size_t bytes() const {
    std::size_t sum = sizeof *this + names.capacity() * sizeof names.front() + (id ? id->capacity() : 0);
    for (const std::string& name : names) sum += name.capacity();
    return sum;
  }
};
/// Something that would change the box.
struct Refused {
  std::string operation;
};
/// An operation that this version does not know or that asks for what is not offered.
struct Ignored {};

using FoxgloveRequest = std::variant<Subscribe, Unsubscribe, GetParameters, Refused, Ignored>;

/// Parses a text message from a client.  Errors: what is wrong with it, for people.  Thread: any.
std::expected<FoxgloveRequest, std::string> parseFoxgloveRequest(std::string_view text);

}  // namespace hapticd::tools::view
