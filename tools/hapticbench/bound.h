// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

namespace hapticd::tools {

/// Something that a law must keep, and what was measured of it.
struct Bound {
  std::string law;
  std::string what;
  std::string limit;   ///< "at most 0.1 N"
  std::string figure;  ///< empty: not measured
  bool kept = false;

  /// `figure` at most `limit`, both in `unit`.
  static Bound atMost(std::string law, std::string what, double limit, double figure,
                      const std::string& unit);
  /// At least `limit`.
  static Bound atLeast(std::string law, std::string what, double limit, double figure,
                       const std::string& unit);
  static Bound notMeasured(std::string law, std::string what);
};

/// A line for each, with "kept", "NOT KEPT" or "not measured".
std::string boundsTable(std::span<const Bound> bounds);

/// The same for programs: a JSON array.
std::string boundsJson(std::span<const Bound> bounds);

}  // namespace hapticd::tools
