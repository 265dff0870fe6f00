// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/error.h"

/// The parts of files of the source tree that follow from tables. Each function takes the text of such a file
/// and returns it with these parts made anew; everything else, such as the comment above a group, stays as it
/// is.
namespace hapticd::tools {

/// config/hapticd.yaml: for each row of config::parameterTable(), in its group, a line with the help and the
/// line "  # name: default  # range; live". Errors: a group of the table that the file does not have.
base::Result<std::string> withParameters(std::string_view configuration);

/// docs/fixtures.md: what is allowed for each member of fixtures and regions, in the third cell of its row.
/// Errors: a member that has no row.
base::Result<std::string> withMembers(std::string_view document);

/// A Varlink interface: the types that stand for enumerations ("type Law (..)") and for the structures of the
/// status, from their words and rows. The comment above a type is kept.
std::string withTypes(std::string_view interface);

}  // namespace hapticd::tools
