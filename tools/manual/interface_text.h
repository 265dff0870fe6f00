// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"

namespace hapticd::tools {

/// A field of a Varlink type, method or error; a word of an enumeration has no type.
struct InterfaceField {
  std::string name;
  std::string type;  ///< "?int", "[]Parameter"
  std::string comment;
};

/// A type, method or error.
struct InterfaceItem {
  std::string kind;  ///< "type", "method", "error"
  std::string name;
  std::string comment;
  std::vector<InterfaceField> fields;   ///< what a method takes, what the others hold
  std::vector<InterfaceField> answers;  ///< of a method
};

struct InterfaceText {
  std::string name;
  std::string comment;
  std::vector<InterfaceItem> items;
};

/// Reads an interface definition. A comment belongs to what follows it.
/// Errors: what is no Varlink interface definition, with the line.
/// Source: varlink.org/Interface-Definition.
config::Result<InterfaceText> parseInterface(std::string_view text);

}  // namespace hapticd::tools
