// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace hapticd::tools {

/// Prints the help of a command as CLI11 does, in lines of at most 80 columns: texts are wrapped, and the
/// words that an option accepts are listed in its text where they do not fit beside its name.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_footer(const CLI::App* command) const override;

 private:
  /// A name in the left column and its text, wrapped, in the right one.
  std::string row(const std::string& name, const std::string& text) const;
};

}  // namespace hapticd::tools
