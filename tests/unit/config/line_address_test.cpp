// SPDX-License-Identifier: Apache-2.0
// How the line of an LED is written, and what is refused.

#include <gtest/gtest.h>

#include <string>

#include "config/settings/line_address.h"
#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

void expectAddress(std::string_view text, const LineAddress& expected) {
  const base::Result<LineAddress> line = lineAddressFrom(text);
  ASSERT_TRUE(line) << text << ": " << line.error().text();
  EXPECT_EQ(*line, expected) << text;
}

std::string refusalOf(std::string_view text) {
  const base::Result<LineAddress> line = lineAddressFrom(text);
  return line ? std::string("not refused") : line.error().text();
}

TEST(LineAddress, IsANameOrAnOffsetEachWithOrWithoutActiveLow) {
  expectAddress("STATUS", {"STATUS", 0, false});
  expectAddress("STATUS active-low", {"STATUS", 0, true});
  expectAddress("17", {"", 17, false});
  expectAddress("17 active-low", {"", 17, true});
}

TEST(LineAddress, TakesWhatNamesOfLinesHoldInBoardsDescriptions) {
  for (const char* name : {"GPIO17", "led-power", "PIN 11", "17A", "-1", "[UART1-RXD]", "nRESET", "!LED"}) {
    expectAddress(name, {name, 0, false});
  }
}

TEST(LineAddress, TakesOffsetsUpToTheLargest) {
  expectAddress("0", {"", 0, false});
  expectAddress("65535", {"", 65535, false});
  for (const char* offset : {"65536", "2147483648", "99999999999999999999"}) {
    EXPECT_EQ(refusalOf(offset), "\"" + std::string(offset) +
                                     "\" is not the offset of a line (allowed: 0..65535) (gpioinfo lists the "
                                     "lines of each chip)");
  }
}

TEST(LineAddress, TakesNamesUpToTheKernelsLength) {
  expectAddress(std::string(31, 'n'), {std::string(31, 'n'), 0, false});
  expectAddress(std::string(31, 'n') + " active-low", {std::string(31, 'n'), 0, true});
  EXPECT_NE(refusalOf(std::string(32, 'n')).find("has 32 bytes, the name of a line at most 31"),
            std::string::npos);
}

TEST(LineAddress, RefusesWhatNamesNoLine) {
  for (const char* text : {"", " active-low", "active-low"}) {
    EXPECT_EQ(refusalOf(text), "\"" + std::string(text) +
                                   "\" names no line (write it as NAME, OFFSET, NAME active-low or OFFSET "
                                   "active-low)");
  }
}

TEST(LineAddress, RefusesSpacesThatAreNoPartOfAName) {
  for (const char* text : {" ", " 17", "17 ", "17  active-low", "STATUS active-low "}) {
    EXPECT_NE(refusalOf(text), "not refused") << text;
  }
}

TEST(LineAddress, RefusesAMisspeltActiveLow) {
  for (const char* text : {"17 active_low", "STATUS active low", "17 active-high", "17 active-lo"}) {
    EXPECT_EQ(refusalOf(text), "\"" + std::string(text) +
                                   "\" does not end in \"active-low\" (write it as NAME, OFFSET, NAME "
                                   "active-low or OFFSET active-low)");
  }
}

TEST(LineAddress, IsShownAsWhatItIs) {
  EXPECT_EQ(textOf({"", 17, true}), "line 17");
  EXPECT_EQ(textOf({"STATUS", 0, false}), "line \"STATUS\"");
}

TEST(LineAddress, IsWrittenInAFileWithoutQuotes) {
  const test::TemporaryFolder folder;
  const auto loaded = loadSettings(folder.write("leds.yaml",
                                                "leds:\n"
                                                "  driver: gpiod\n"
                                                "  chip: gpiochip0\n"
                                                "  power_line: 17\n"
                                                "  fault_line: STATUS active-low\n"));
  ASSERT_TRUE(loaded) << loaded.error().front().text();
  EXPECT_EQ(loaded->leds.driver, LedDriver::gpiod);
  EXPECT_EQ(loaded->leds.chip, "gpiochip0");
  EXPECT_EQ(loaded->leds.power_line, "17");
  EXPECT_EQ(loaded->leds.fault_line, "STATUS active-low");
  EXPECT_EQ(loaded->leds.camera_line, "");
}

}  // namespace
}  // namespace hapticd::config
