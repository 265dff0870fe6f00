// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <utility>

namespace hapticd::base {

/// Describes what went wrong, for the person who can fix it.
struct Error {
  std::string where;   ///< file and line, parameter, socket or device; may be empty
  std::string what;    ///< the problem, with the offending value and the allowed range
  std::string remedy;  ///< what to do about it; may be empty

  /// Returns "where: what (remedy)" without the parts that are empty, in one line of printable text.
  std::string text() const;
};

template <typename T>
using Result = std::expected<T, Error>;

/// The error as the result of a function.
inline std::unexpected<Error> failure(std::string where, std::string what, std::string remedy) {
  return std::unexpected(Error{std::move(where), std::move(what), std::move(remedy)});
}

}  // namespace hapticd::base
