// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

namespace hapticd::tools {

/// `text` so that roff prints it as it stands: backslashes and hyphens escaped, no line begins with a
/// request. A list without blanks may break after its commas.
std::string plainRoff(std::string_view text);

/// A paragraph with a hanging label in bold: `.TP`, the label, the text.
std::string labelled(std::string_view label, std::string_view text);

/// An option or subcommand and what it does.
struct HelpEntry {
  std::string name;  ///< "-c,--config FILE REQUIRED", "watch"
  std::string text;
};

/// The output of a program for --help.
struct HelpText {
  std::string usage;  ///< "hapticctl watch [OPTIONS]", without the program's folder
  std::vector<HelpEntry> arguments;
  std::vector<HelpEntry> options;
  std::vector<HelpEntry> commands;
  std::vector<HelpEntry> exit_statuses;  ///< "0", "done"
};

/// Parses the output of CLI11: two blanks before an entry, its text from the 31st column on or, where
/// the name is long, in the lines below. Unknown parts are skipped.
HelpText parseHelp(std::string_view printed);

/// A Varlink interface definition in roff: a section with its methods, then errors, then types, each with its
/// fields. The text has an item, or a field of it, in each line, and comments in lines above what they belong
/// to. Errors: another form, with the line.
base::Result<std::string> interfaceSection(std::string_view text);

/// The parameter table in roff: a subsection for each group, a labelled paragraph for each parameter.
std::string parameterSection();

struct PageSource {
  std::string template_text;
  std::string program;  ///< path of the program that the page describes; empty when it describes none
  std::string version;
  std::vector<std::string> interfaces = {};  ///< texts of the Varlink interfaces that the page describes
};

/// The finished page.
/// Errors: the program fails with --help, a text is not an interface, an unknown placeholder.
base::Result<std::string> manualPage(const PageSource& source);

}  // namespace hapticd::tools
