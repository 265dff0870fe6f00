// SPDX-License-Identifier: Apache-2.0
// The lines of LEDs: their form, and what is refused.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/line_address.h"
#include "config/parameter_table.h"
#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

using Texts = std::vector<std::string>;

void expectAddress(std::string_view text, const LineAddress& expected) {
  const Result<LineAddress> line = lineAddressFrom(text);
  ASSERT_TRUE(line) << text << ": " << line.error().text();
  EXPECT_EQ(*line, expected) << text;
}

std::string refusalOf(std::string_view text) {
  const Result<LineAddress> line = lineAddressFrom(text);
  return line ? std::string("not refused") : line.error().text();
}

Texts conflictsOf(const Texts& changes) {
  Settings settings;
  for (const std::string& change : changes) {
    const Result<void> result = setFromText(settings, change);
    EXPECT_TRUE(result) << result.error().text();
  }
  Texts texts;
  for (const Error& error : checkTogether(settings)) texts.push_back(error.text());
  return texts;
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

TEST(LedSettings, AnySubsetOfTheLedsWillDo) {
  for (const char* line :
       {"leds.power_line=1", "leds.camera_line=1", "leds.contact_line=1", "leds.fault_line=1"}) {
    EXPECT_EQ(conflictsOf({"leds.driver=gpiod", "leds.chip=box", line}), Texts{});
  }
}

TEST(LedSettings, TheDriverNeedsAChip) {
  EXPECT_EQ(
      conflictsOf({"leds.driver=gpiod", "leds.power_line=1"}),
      Texts{"leds.chip: is empty, and the leds.driver gpiod needs it (set leds.chip to the label, the name "
            "or the path of a chip (gpiodetect lists them))"});
}

TEST(LedSettings, TheDriverNeedsALine) {
  EXPECT_EQ(
      conflictsOf({"leds.driver=gpiod", "leds.chip=box"}),
      Texts{"leds.driver: gpiod has no LED to switch (set at least one of leds.power_line, leds.camera_line, "
            "leds.contact_line and leds.fault_line, or leds.driver to none)"});
}

TEST(LedSettings, NothingIsNeededWithoutADriver) {
  EXPECT_EQ(conflictsOf({"leds.chip=box"}), Texts{});
  EXPECT_EQ(conflictsOf({"leds.power_line=1"}), Texts{});
}

TEST(LedSettings, TwoLedsMayNotShareALine) {
  EXPECT_EQ(
      conflictsOf({"leds.power_line=7", "leds.fault_line=007 active-low"}),
      Texts{"leds.fault_line: line 7 is also leds.power_line (give each LED a line of its own, or leave one "
            "of the two empty)"});
  EXPECT_EQ(
      conflictsOf({"leds.camera_line=STATUS", "leds.contact_line=STATUS"}),
      Texts{
          "leds.contact_line: line \"STATUS\" is also leds.camera_line (give each LED a line of its own, or "
          "leave one of the two empty)"});
  EXPECT_EQ(conflictsOf({"leds.power_line=0", "leds.camera_line=STATUS"}), Texts{});
}

TEST(LedSettings, EveryLineThatCannotBeReadIsReportedAtItsPlace) {
  const Texts texts =
      conflictsOf({"leds.power_line=99999", "leds.camera_line=5 active", "leds.contact_line=5"});
  ASSERT_EQ(texts.size(), 2U);
  EXPECT_TRUE(texts[0].starts_with("leds.power_line: \"99999\" is not the offset")) << texts[0];
  EXPECT_TRUE(texts[1].starts_with("leds.camera_line: \"5 active\" does not end in")) << texts[1];
}

TEST(LedSettings, AreWrittenInAFileWithoutQuotes) {
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
