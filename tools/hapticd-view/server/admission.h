// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace hapticd::tools::view {

/// A connection on which no WebSocket is open yet.
struct OpenConnection {
  std::string owner;         ///< who is at the other end (connectionOwner())
  bool is_admitted = false;  ///< its request has been accepted, and is being answered
};

/// How many connections there may be at once.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_owner = 0;
};

/// What becomes of a new connection.
struct Admission {
  bool is_served = true;
  std::optional<std::size_t> gives_way = {};  ///< the one to be closed before, a place in the list
};

/// Decides about a new connection of `owner` beside those that are open, the oldest first. Where there are
/// too many, the oldest one that has not been admitted gives way: of the same owner if he has his share, else
/// of the owner who has most such connections. So connections that send nothing keep nobody out.
Admission admissionOf(std::span<const OpenConnection> open, const std::string& owner,
                      const ConnectionLimits& limits);

}  // namespace hapticd::tools::view
