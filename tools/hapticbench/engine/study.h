// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/parts/fields.h"

namespace CLI {
class App;
}

namespace hapticd::tools {

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

/// The cases with each of the values in turn: of several members, the one that is varied first changes last.
template <typename Case, typename Value>
std::vector<Case> varied(const std::vector<Case>& cases, Value Case::*member,
                         const std::vector<Value>& values) {
  std::vector<Case> all;
  for (const Case& one : cases) {
    for (const Value& value : values) all.emplace_back(one).*member = value;
  }
  return all;
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
  /// A number within the range.
  template <typename Number>
  void number(const std::string& option, Number& value, Number lowest, Number highest,
              const std::string& help);
  /// Numbers with commas between them, each within the range.
  template <typename Number>
  void numbers(const std::string& option, std::vector<Number>& values, Number lowest, Number highest,
               const std::string& help);
  void flag(const std::string& option, bool& value, const std::string& help);
  /// The name of a file with that ending.
  void file(const std::string& option, std::string& name, const char* ending, const std::string& help);
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

  void footer(const std::string& text);

  /// Sets the function of the subcommand, which returns the exit status.
  void onRun(const std::function<int(const StudyCommand&)>& run) { run_ = run; }
  /// The same for a study that always has a report.
  void onReport(const std::function<Report()>& report_of) {
    run_ = [report_of](const StudyCommand& self) { return self.report(report_of()); };
  }
  bool chosen() const;
  /// With --join, onRun() finds the options that the parts were computed with.
  int run() const;

  /// Reports `report_of(results)`, with `measure(case)` of each of the cases in their order; with --join,
  /// with what the parts hold. With --part measures only its cases and writes them to the file of --json, for
  /// --join. `measure` computes a case by itself: its result does not depend on which others are measured.
  /// Returns the exit status.
  template <typename Case, typename Measure, typename ReportOf>
  int forEachCase(const std::vector<Case>& cases, const Measure& measure, const ReportOf& report_of) const {
    std::vector<std::decay_t<decltype(measure(cases.front()))>> results;
    return divided({.count = cases.size(),
                    .measure = [&](std::size_t index) { results.push_back(measure(cases[index])); },
                    .write = [&] { return toFields(results); },
                    .read = [&](const nlohmann::json& kept) { fromFields(kept, results); },
                    .report = [&] { return report_of(results); }});
  }

  /// Prints the report, writes it to the file of --json and draws it into that of --plot. Returns the exit
  /// status.
  int report(const Report& report) const;

 private:
  /// A run over cases by their numbers; the results are those of the cases that were measured or read.
  struct Cases {
    std::size_t count = 0;
    std::function<void(std::size_t index)> measure;
    std::function<nlohmann::json()> write;
    std::function<void(const nlohmann::json&)> read;
    std::function<Report()> report;
  };
  struct Files;

  int divided(const Cases& cases) const;
  int print(const std::string& text, const std::string& json) const;
  void pick(const std::string& option, const std::vector<std::string>& all, const std::string& usual,
            const std::function<void(const std::vector<std::string>&)>& set);
  std::string path() const;
  std::vector<std::string> optionsOfResults() const;
  base::Result<void> join() const;

  CLI::App* command_;
  std::shared_ptr<Files> files_;
  std::function<int(const StudyCommand&)> run_;
};

/// Creates the subcommand of each study. `app` outlives them.
StudyCommand accuracyCommand(CLI::App& app);
StudyCommand buzzCommand(CLI::App& app);
StudyCommand jitterCommand(CLI::App& app);
StudyCommand camerasCommand(CLI::App& app);
StudyCommand fixturesCommand(CLI::App& app);
StudyCommand godobjectCommand(CLI::App& app);
StudyCommand noiseCommand(CLI::App& app);
StudyCommand occlusionCommand(CLI::App& app);
StudyCommand paretoCommand(CLI::App& app);
StudyCommand recordingsCommand(CLI::App& app);
StudyCommand solidsCommand(CLI::App& app);
StudyCommand stabilityCommand(CLI::App& app);
StudyCommand strokesCommand(CLI::App& app);
StudyCommand trackingCommand(CLI::App& app);

}  // namespace hapticd::tools
