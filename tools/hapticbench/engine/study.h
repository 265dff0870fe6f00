// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/law_choice.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/parts/fields.h"
#include "tools/lib/parts/parts.h"

namespace hapticd::tools {

using config::nameOf;

/// Prints `error` and returns `status`.
int fail(const base::Error& error, int status);
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

/// A subcommand of hapticbench, with --json and --plot. Its options write straight into what the study takes,
/// in the order in which they are added here, so that --quick, added first, is overridden by whatever else is
/// named.
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
  /// --part and --join, for a study of independent cases; added after all other options.
  void parts();

  /// Sets the function of the subcommand, which returns the exit status.
  void onRun(const std::function<int(const StudyCommand&)>& run) { run_ = run; }
  bool chosen() const { return command_->parsed(); }
  /// With --join, onRun() finds the options that the parts were computed with.
  int run() const;
  /// The run that --join put together; nothing without it.
  const std::optional<PartFile>& joined() const { return *joined_; }

  /// Reports `report_of(results)`, with `measure(case)` of each of the cases in their order; with --join,
  /// with what the parts hold. With --part measures only its cases and writes them to the file of --json, for
  /// --join. `measure` computes a case by itself: its result does not depend on which others are measured.
  /// `input`: what the results depend on besides options and version. Returns the exit status.
  template <typename Case, typename Measure, typename ReportOf>
  int forEachCase(const std::vector<Case>& cases, const Measure& measure, const ReportOf& report_of,
                  const nlohmann::json& input = nlohmann::json::object()) const {
    std::vector<std::decay_t<decltype(measure(cases.front()))>> results;
    if (joined()) {
      const auto read = fromJoined(cases.size(), [&results](const auto& json) { fromFields(json, results); });
      return read ? report(report_of(results)) : fail(read.error(), EX_DATAERR);
    }
    for (std::size_t index = 0; index < cases.size(); ++index) {
      if (division_->part && !division_->part->has(index)) continue;
      showProgress(fmt::format("case {} of {}", index + 1, cases.size()));
      results.push_back(measure(cases[index]));
    }
    return division_->part ? writePart(cases.size(), input, toFields(results)) : report(report_of(results));
  }

  /// Prints the report, writes it to the file of --json and draws it into that of --plot. Returns the exit
  /// status.
  int report(const Report& report) const;

 private:
  int print(const std::string& text, const std::string& json) const;
  void pick(const std::string& option, const std::vector<std::string>& all, const std::string& usual,
            const std::function<void(const std::vector<std::string>&)>& set);
  std::string path() const { return "hapticbench " + command_->get_name(); }
  std::vector<std::string> optionsOfResults() const;
  base::Result<void> join() const;
  base::Result<void> fromJoined(std::size_t cases,
                                const std::function<void(const nlohmann::json&)>& read) const;
  int writePart(std::size_t cases, const nlohmann::json& input, const nlohmann::json& results) const;

  CLI::App* command_;
  std::shared_ptr<std::string> json_file_ = std::make_shared<std::string>();
  std::shared_ptr<std::string> plot_file_ = std::make_shared<std::string>();
  std::shared_ptr<Division> division_ = std::make_shared<Division>();
  std::shared_ptr<std::optional<PartFile>> joined_ = std::make_shared<std::optional<PartFile>>();
  std::function<int(const StudyCommand&)> run_;
};

/// Creates the subcommand of each study. `app` outlives them.
StudyCommand accuracyCommand(CLI::App& app);
StudyCommand buzzCommand(CLI::App& app);
StudyCommand jitterCommand(CLI::App& app);
StudyCommand camerasCommand(CLI::App& app);
StudyCommand fixturesCommand(CLI::App& app);
StudyCommand noiseCommand(CLI::App& app);
StudyCommand occlusionCommand(CLI::App& app);
StudyCommand paretoCommand(CLI::App& app);
StudyCommand recordingsCommand(CLI::App& app);
StudyCommand solidsCommand(CLI::App& app);
StudyCommand stabilityCommand(CLI::App& app);
StudyCommand strokesCommand(CLI::App& app);
StudyCommand trackingCommand(CLI::App& app);

}  // namespace hapticd::tools
