// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/interface_section.h"

#include "tools/manual/roff.h"

namespace hapticd::tools {
namespace {

std::string paragraph(const std::string& text) {
  return text.empty() ? "" : ".PP\n" + plainRoff(text) + "\n";
}

bool isEnumeration(const InterfaceItem& item) {
  return !item.fields.empty() && item.fields.front().type.empty();
}

std::string wordsOf(const InterfaceItem& item) {
  std::string words;
  for (const InterfaceField& field : item.fields) words += (words.empty() ? "One of: " : ", ") + field.name;
  return paragraph(words + ".");
}

std::string fieldsOf(const std::vector<InterfaceField>& fields) {
  std::string roff;
  for (const InterfaceField& field : fields) {
    roff +=
        labelled(field.name + ": " + field.type, field.comment.empty() ? "See above." : field.comment + ".");
  }
  return roff;
}

std::string itemText(const InterfaceItem& item) {
  std::string roff = ".SS " + plainRoff(item.kind + " " + item.name) + "\n" + paragraph(item.comment);
  if (isEnumeration(item)) return roff + wordsOf(item);
  if (item.kind != "method") return roff + fieldsOf(item.fields);
  roff += paragraph(item.fields.empty() ? "Takes nothing." : "Takes:") + fieldsOf(item.fields);
  return roff + paragraph(item.answers.empty() ? "Answers nothing." : "Answers:") + fieldsOf(item.answers);
}

}  // namespace

std::string interfaceSection(const InterfaceText& interface) {
  std::string roff = ".SH \"" + plainRoff(interface.name) + "\"\n" + paragraph(interface.comment);
  for (const char* kind : {"method", "error", "type"}) {
    for (const InterfaceItem& item : interface.items) {
      if (item.kind == kind) roff += itemText(item);
    }
  }
  return roff;
}

}  // namespace hapticd::tools
