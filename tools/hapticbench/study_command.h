// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/error.h"
#include "config/law_choice.h"
#include "tools/lib/options/within.h"

namespace hapticd::tools {

using config::nameOf;

/// Called with the name of what is measured next.
using Progress = std::function<void(const std::string&)>;

/// Prints `error` and returns `status`.
int fail(const config::Error& error, int status);
/// Writes a whole file in place of one of that name; nothing where `file` is empty. Returns the exit status.
int writeReport(const std::string& file, const std::string& text);
/// Shows what is measured on one line of the terminal; does nothing if standard error is not a terminal.
void showProgress(const std::string& what);

/// The names of `values`, by their nameOf().
template <typename Values>
std::vector<std::string> namesOf(const Values& values) {
  std::vector<std::string> names;
  for (const auto& value : values) names.emplace_back(nameOf(value));
  return names;
}

/// A subcommand of hapticbench. Its options write straight into what the study takes, in the order in which
/// they are added here, so that --quick, added first, is overridden by whatever else is named.
class StudyCommand {
 public:
  StudyCommand(CLI::App& app, const std::string& name, const std::string& description);

  CLI::App* operator->() { return command_; }

  /// `change` is called where --quick is given.
  void quick(const std::string& help, const std::function<void()>& change);
  /// Numbers with commas between them, each within the range.
  template <typename Number>
  void numbers(const std::string& option, std::vector<Number>& values, Number lowest, Number highest,
               const std::string& help) {
    command_->add_option(option, values, help)->delimiter(',')->check(within(lowest, highest));
  }
  /// Numbers in millimetres with commas between them; `set` receives metres.
  void millimetres(const std::string& option, double lowest_mm, double highest_mm, const std::string& help,
                   const std::function<void(const std::vector<double>& values_m)>& set);
  /// Names out of `all`, with commas between them.
  void names(const std::string& option, std::vector<std::string>& chosen, const std::vector<std::string>& all,
             const std::string& usual);
  /// Values out of `all`, by their nameOf(), in the order of `all`.
  template <typename Value, typename Values>
  void choices(const std::string& option, std::vector<Value>& chosen, const Values& all,
               const std::string& usual) {
    pick(option, namesOf(all), usual, [&chosen, all](const std::vector<std::string>& picked) {
      chosen.clear();
      for (const Value& value : all) {
        if (std::ranges::find(picked, nameOf(value)) != picked.end()) chosen.push_back(value);
      }
    });
  }
  void seed(std::uint32_t& seed, const std::string& help);
  /// --recordings; `folder` is set to where they are looked for unless it is given.
  void recordings(std::string& folder);
  /// --json, which report() writes.
  void json();

  /// Sets the function of the subcommand, which returns the exit status.
  void onRun(const std::function<int(const StudyCommand&)>& run) { run_ = run; }
  bool chosen() const { return command_->parsed(); }
  int run() const { return run_(*this); }
  /// Prints `text` and writes `json` to the file of --json. Returns the exit status.
  int report(const std::string& text, const std::string& json) const;

 private:
  void pick(const std::string& option, const std::vector<std::string>& all, const std::string& usual,
            const std::function<void(const std::vector<std::string>&)>& set);

  CLI::App* command_;
  std::shared_ptr<std::string> json_file_ = std::make_shared<std::string>();
  std::function<int(const StudyCommand&)> run_;
};

/// Creates the subcommand of each study. `app` outlives them.
StudyCommand accuracyCommand(CLI::App& app);
StudyCommand jitterCommand(CLI::App& app);
StudyCommand noiseCommand(CLI::App& app);
StudyCommand occlusionCommand(CLI::App& app);
StudyCommand paretoCommand(CLI::App& app);
StudyCommand recordingsCommand(CLI::App& app);
StudyCommand stabilityCommand(CLI::App& app);
StudyCommand strokesCommand(CLI::App& app);
StudyCommand sweepCommand(CLI::App& app);

}  // namespace hapticd::tools
