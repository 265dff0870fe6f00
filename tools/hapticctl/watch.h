// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "tools/hapticctl/base/calls.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// Summarises a stream of Monitor replies.
class WatchSummary {
 public:
  void add(const Json& reply);
  /// The summary in several lines for people: ticks, overruns, frames, points, force range and percentiles.
  /// Counters and percentiles are those of the daemon since its start, the force range is that of the added
  /// replies.
  std::string text() const;
  /// The same for programs: the last status, with the range of the force.
  Json json() const;

 private:
  Json status_;
  double min_force_n_ = std::nan("");
  double max_force_n_ = std::nan("");
};

/// The largest forces of the newest windows, drawn with characters.
class ForceHistory {
 public:
  static constexpr std::size_t kWindows = 60;

  /// Adds the largest force of a window, in newtons; NaN for a window without ticks, which leaves a gap.
  void add(double max_force_n);

  /// `rows` lines of at most `columns`, the newest window at the right, the scale at the left: a round number
  /// of newtons that holds all of them. UTF-8 draws with block elements, eight steps a row; else with '#',
  /// '+' and '.'.
  std::vector<std::string> lines(std::size_t rows, std::size_t columns, bool utf8) const;

 private:
  std::deque<double> forces_n_;
};

/// Uses the alternate screen of the terminal, with a hidden cursor, while the object lives. It writes the
/// ANSI sequences of xterm, which all common terminals understand. stdout must be a terminal.
class Screen {
 public:
  Screen() { enter(); }
  ~Screen() { leave(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Replaces the shown lines without clearing the screen first, which would flicker. False if the terminal
  /// is gone.
  bool show(const std::vector<std::string>& lines);
  /// Gives the terminal back while the program is stopped (Ctrl-Z), and takes it again.
  void stop();

 private:
  void enter();
  void leave();
};

struct WatchOptions {
  int interval_ms = 200;
  int count = 0;                    ///< end after that many states; 0: no end
  int seconds = 0;                  ///< end after that time; 0: no end
  bool line = false;                ///< one line that is written over, instead of the table
  bool summary = false;             ///< print a summary at the end, also after Ctrl-C
  std::vector<std::string> fields;  ///< of the status, for JSON; empty: all
};

/// Prints the state continuously until Ctrl-C or the end that `watch` sets: on a terminal as a table or a
/// line that is updated in place, else line by line. It survives a restart of the daemon: it connects again,
/// and reports that on standard error. The terminal is as before at the end, whatever ends it. Returns the
/// exit code.
int runWatch(const CommandOptions& options, const WatchOptions& watch);

}  // namespace hapticd::tools
