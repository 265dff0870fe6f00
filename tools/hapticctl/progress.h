// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools {

/// "reading 42 %" on stderr, written over; nothing where stderr is no terminal.
class ProgressLine {
 public:
  explicit ProgressLine(std::string doing);
  ~ProgressLine() { end(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// `share`: 0..1.
  void show(double share);
  /// Takes the line away.
  void end();

 private:
  std::string doing_;
  bool terminal_;
  int shown_percent_ = -1;
};

}  // namespace hapticd::tools
