// SPDX-License-Identifier: Apache-2.0
#include "config/value_text.h"

#include <gtest/gtest.h>

namespace hapticd::config {
namespace {

TEST(Printable, LeavesTextInAllLanguagesAsItIs) {
  for (const char* text : {"", "plain", "H\xc3\xb6he \xe2\x89\xa4 4 N", "\xe6\x89\x8b", "\xf0\x9f\x96\x90"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, EscapesTerminalControlsAndLineBreaks) {
  EXPECT_EQ(printable("a\x1b[2Jb\r\n\t\x7f"), "a\\x1b[2Jb\\x0d\\x0a\\x09\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m");                                     // CSI as one character of C1
  EXPECT_EQ(printable("\xe2\x80\xa8|\xe2\x80\xae|\xef\xbb\xbf"),  // U+2028, U+202E, U+FEFF
            "\\xe2\\x80\\xa8|\\xe2\\x80\\xae|\\xef\\xbb\\xbf");
  EXPECT_EQ(printable("\x9b|\xc3|\xed\xa0\x80"), "\\x9b|\\xc3|\\xed\\xa0\\x80");  // not UTF-8
}

TEST(InQuotes, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(inQuotes(std::string(3000, 'x')), "\"" + std::string(60, 'x') + "...\"");
  EXPECT_EQ(inQuotes(std::string(59, 'x') + "\xc3\xb6"), "\"" + std::string(59, 'x') + "...\"");
  EXPECT_EQ(inQuotes(std::string(58, 'x') + "\xc3\xb6"), "\"" + std::string(58, 'x') + "\xc3\xb6\"");
  EXPECT_EQ(inQuotes("\xc2\x9b"), "\"\\xc2\\x9b\"");
}

TEST(FirstUnprintable, NamesPlaceAndCharacter) {
  EXPECT_FALSE(firstUnprintable("a\xc3\xb6"));
  const auto found = firstUnprintable("\xc3\xb6\xc2\x85");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->at, 2U);
  EXPECT_EQ(found->code_point, U'\u0085');
}

}  // namespace
}  // namespace hapticd::config
