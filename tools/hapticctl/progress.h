// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools {

/// A line such as "reading 42 %" on stderr that is overwritten as work goes on; nothing if stderr is not a
/// terminal that understands control sequences.
class ProgressLine {
 public:
  explicit ProgressLine(std::string doing);
  ~ProgressLine() { end(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// `share`: 0..1.
  void show(double share);
  /// Erases the line.
  void end();

 private:
  std::string doing_;
  bool terminal_;
  int shown_percent_ = -1;
};

}  // namespace hapticd::tools
