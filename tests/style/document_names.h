// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::test {

/// A program or one of its subcommands, by its `--help`.
struct KnownCommand {
  std::map<std::string, bool> options;  ///< "--config", "-c": whether a value follows
  std::map<std::string, KnownCommand> commands;
};

/// How a text marks what is not prose.
enum class TextKind {
  markdown,  ///< names stand in backticks and in code
  comments,  ///< only the lines that begin with '#' count, without it
  plain,     ///< help and manual pages
};

/// A name that is no mistake although nothing here has it.
struct NameException {
  std::string_view name;
  std::string_view reason;
};

/// What names in documents are compared with: the source tree, the parameter table and the help of programs.
class DocumentNames {
 public:
  /// Reads the sources below `root`, except what git does not keep and the folders `ignored` (relative).
  DocumentNames(const std::filesystem::path& root, const std::vector<std::string>& ignored);

  /// Runs the program and each of its subcommands with --help; returns their texts.
  std::vector<std::string> addProgram(const std::string& name, const std::string& path);
  void add(const std::string& program, KnownCommand command) { programs_[program] = std::move(command); }
  void except(const NameException& exception) { exceptions_.emplace(exception.name); }

  /// The files below the root, relative to it.
  const std::set<std::string>& files() const { return files_; }

  /// Returns each wrong name in a text as "file:line: what is wrong". `file`: relative to the root.
  std::vector<std::string> wrongIn(const std::string& file, std::string_view text, TextKind kind) const;

 private:
  class Check;

  std::filesystem::path root_;
  std::set<std::string> files_;
  std::set<std::string> names_;  ///< of files and folders, without their paths
  std::map<std::string, std::set<int>, std::less<>>
      words_;  ///< identifiers of the sources, and in which files
  std::map<std::string, KnownCommand> programs_;
  std::set<std::string, std::less<>> exceptions_;
};

}  // namespace hapticd::test
