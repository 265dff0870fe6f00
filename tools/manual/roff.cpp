// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/roff.h"

#include <cctype>

namespace hapticd::tools {
namespace {

bool blankAt(std::string_view text, std::size_t place) {
  return place >= text.size() || std::isspace(static_cast<unsigned char>(text[place])) != 0;
}

}  // namespace

std::string plainRoff(std::string_view text) {
  std::string roff;
  bool line_begins = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char character = text[i];
    if (line_begins && (character == '.' || character == '\'')) roff += "\\&";
    line_begins = character == '\n';
    if (character == '\\' || character == '-') roff += '\\';
    roff += character == '\\' ? 'e' : character;
    // a list without blanks may break too
    if (character == ',' && !blankAt(text, i + 1)) roff += "\\:";
  }
  return roff;
}

std::string labelled(std::string_view label, std::string_view text) {
  return ".TP\n\\fB" + plainRoff(label) + "\\fR\n" + plainRoff(text) + "\n";
}

}  // namespace hapticd::tools
