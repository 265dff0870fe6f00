// SPDX-License-Identifier: Apache-2.0
// Errors and values as texts, and files that are read: their content, images of labels.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <string>
#include <utility>

#include "config/base/counted.h"
#include "config/base/error.h"
#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "config/settings/label_image.h"
#include "config/settings/yaml_text.h"
#include "config/yaml_loader.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

TEST(Error, TextJoinsThePartsThatAreThere) {
  EXPECT_EQ((base::Error{"demo.yaml:7", "is wrong", "mend it"}.text()), "demo.yaml:7: is wrong (mend it)");
  EXPECT_EQ((base::Error{"demo.yaml:7", "is wrong", ""}.text()), "demo.yaml:7: is wrong");
  EXPECT_EQ((base::Error{"", "is wrong", "mend it"}.text()), "is wrong (mend it)");
  EXPECT_EQ((base::Error{"", "is wrong", ""}.text()), "is wrong");
}

}  // namespace
}  // namespace hapticd::config

namespace hapticd::config {
namespace {

TEST(Printable, LeavesTextInAllLanguagesAsItIs) {
  for (const char* text : {"", "plain", "H\xc3\xb6he \xe2\x89\xa4 4 N", "\xe6\x89\x8b", "\xf0\x9f\x96\x90"}) {
    EXPECT_EQ(base::printable(text), text);
  }
}

TEST(Printable, EscapesTerminalControlsAndLineBreaks) {
  EXPECT_EQ(base::printable("a\x1b[2Jb\r\n\t\x7f"), "a\\x1b[2Jb\\x0d\\x0a\\x09\\x7f");
  EXPECT_EQ(base::printable("\xc2\x9b"
                            "31m"),
            "\\xc2\\x9b31m");                                           // CSI as one character of C1
  EXPECT_EQ(base::printable("\xe2\x80\xa8|\xe2\x80\xae|\xef\xbb\xbf"),  // U+2028, U+202E, U+FEFF
            "\\xe2\\x80\\xa8|\\xe2\\x80\\xae|\\xef\\xbb\\xbf");
  EXPECT_EQ(base::printable("\x9b|\xc3|\xed\xa0\x80"), "\\x9b|\\xc3|\\xed\\xa0\\x80");  // not UTF-8
}

TEST(InQuotes, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(base::inQuotes(std::string(3000, 'x')), "\"" + std::string(60, 'x') + "...\"");
  EXPECT_EQ(base::inQuotes(std::string(59, 'x') + "\xc3\xb6"), "\"" + std::string(59, 'x') + "...\"");
  EXPECT_EQ(base::inQuotes(std::string(58, 'x') + "\xc3\xb6"), "\"" + std::string(58, 'x') + "\xc3\xb6\"");
  EXPECT_EQ(base::inQuotes("\xc2\x9b"), "\"\\xc2\\x9b\"");
}

TEST(FirstUnprintable, NamesPlaceAndCharacter) {
  EXPECT_FALSE(base::firstUnprintable("a\xc3\xb6"));
  const auto found = base::firstUnprintable("\xc3\xb6\xc2\x85");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->at, 2U);
  EXPECT_EQ(found->code_point, U'\u0085');
}

}  // namespace
}  // namespace hapticd::config

namespace hapticd::test {
namespace {

using config::allParameters;
using config::Parameter;
using config::Settings;

/// Returns a value in range other than the default; the numbers have no short decimal form.
config::Value unusual(const Parameter& parameter) {
  switch (parameter.kind) {
    case config::Kind::boolean:
      return !std::get<bool>(parameter.defaultValue());
    case config::Kind::integer:
      return static_cast<std::int64_t>(parameter.maximum);
    case config::Kind::number:
      return parameter.minimum + (parameter.maximum - parameter.minimum) / 3;
    case config::Kind::choice:
      return std::string(parameter.choices.back());
    default:
      break;
  }
  return std::string("a \"b\" \\ # c: 'd' \t\x7f");
}

Settings readBack(const std::string& text) {
  const auto loaded = config::settingsFromText(text, "all.yaml");
  EXPECT_TRUE(loaded.has_value()) << loaded.error().front().text() << "\n" << text;
  return loaded.value_or(Settings{});
}

TEST(YamlText, EachParameterReadsBackAsItWas) {
  for (const Parameter& parameter : allParameters()) {
    Settings settings;
    if (parameter.kind == config::Kind::text && parameter.check(unusual(parameter))) {
      parameter.set(settings, unusual(parameter));
    } else if (parameter.kind != config::Kind::text) {
      parameter.set(settings, unusual(parameter));
    }
    const auto only = [&](const Parameter& other) { return other.name == parameter.name; };
    const auto loaded = config::settingsFromText(config::yamlText(settings, only), "one.yaml");
    if (!loaded) continue;  // alone it conflicts with the defaults of other parameters
    EXPECT_EQ(parameter.get(*loaded), parameter.get(settings)) << parameter.name;
  }
}

TEST(YamlText, AllDefaultsReadBack) {
  const Settings loaded = readBack(config::yamlText(Settings{}));
  for (const Parameter& parameter : allParameters()) {
    EXPECT_EQ(parameter.get(loaded), parameter.defaultValue()) << parameter.name;
  }
}

TEST(YamlText, HoldsOnlyWhatIsChosen) {
  const auto springs = [](const Parameter& parameter) { return parameter.name == "force.radius_m"; };
  EXPECT_EQ(config::yamlText(Settings{}, springs), "force:\n  radius_m: 0.04\n");
}

TEST(Counted, HasThePluralForEveryCountButOne) {
  EXPECT_EQ(base::counted(0, "tick(s) in contact"), "0 ticks in contact");
  EXPECT_EQ(base::counted(1, "tick(s) in contact"), "1 tick in contact");
  EXPECT_EQ(base::counted(2U, "pair(s) of hand(s)"), "2 pairs of hands");
  EXPECT_EQ(base::counted("1", "pair(s) of hand(s)"), "1 pair of hand");
  EXPECT_EQ(base::counted("-", "frame(s)"), "- frames") << "a count that is not known";
  EXPECT_EQ(base::counted(1, "damaged"), "1 damaged");
}

}  // namespace
}  // namespace hapticd::test

namespace hapticd::config {
namespace {

using Reason = base::FileFault::Reason;

TEST(FileContent, IsAllOfTheFileUpToTheLongestAllowed) {
  const test::TemporaryFolder folder;
  const std::string long_text(200'000, 'x');
  EXPECT_EQ(base::fileContent(folder.write("a", long_text), {.longest = 200'000}).value_or(""), long_text);
  EXPECT_EQ(base::fileContent(folder.write("b", ""), {.longest = 0}).value_or("?"), "");
  const auto longer = base::fileContent(folder.write("c", long_text + "x"), {.longest = 200'000});
  ASSERT_FALSE(longer);
  EXPECT_EQ(longer.error().reason, Reason::too_long);
  EXPECT_EQ(longer.error().text(), "is longer than 200000 bytes");
}

// Without a writer, opening a pipe for reading waits forever; the test's time limit would end it.
TEST(FileContent, OfAPipeIsRefusedWithoutWaitingWhereARegularFileIsRequired) {
  const test::TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& file : {pipe, std::filesystem::path("/dev/zero")}) {
    const auto content = base::fileContent(file, {.longest = 10});
    ASSERT_FALSE(content) << file;
    EXPECT_EQ(content.error().text(), "is not a regular file");
  }
}

TEST(FileContent, OfADeviceIsReadWhereAnyKindIsAllowed) {
  EXPECT_EQ(base::fileContent("/dev/null", {.longest = 10, .kind = base::FileKind::any}).value_or("?"), "");
}

TEST(FileContent, OfALinkIsReadUnlessLinksAreNotFollowed) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink(folder.write("a", "text"), folder.path() / "link");
  EXPECT_EQ(base::fileContent(folder.path() / "link", {.longest = 10}).value_or("?"), "text");
  const auto refused = base::fileContent(folder.path() / "link", {.longest = 10, .follow_link = false});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().error_number, ELOOP);
}

TEST(FileContent, OfAFolderOrOfNothingIsNone) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(base::fileContent(folder.path(), {.longest = 10}).error().text(),
            "cannot be read: Is a directory");
  EXPECT_EQ(base::fileContent(folder.path() / "none", {.longest = 10}).error().error_number, ENOENT);
}

base::Result<LabelImage> loaded(const std::string& content) {
  const test::TemporaryFolder folder;
  return loadLabelImage(folder.write("labels.pgm", content));
}

std::string pixels() {
  std::string all(640 * 480, '\0');
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<char>(i % 251);
  return all;
}

TEST(LabelImage, IsReadWithAndWithoutComments) {
  const auto plain = loaded("P5\n640 480\n255\n" + pixels());
  ASSERT_TRUE(plain) << plain.error().text();
  EXPECT_EQ(plain->labels, pixels());
  EXPECT_EQ(plain->width_px, 640);
  EXPECT_EQ(plain->height_px, 480);
  const auto commented = loaded("P5 # made by hand\n# twice\n640\t480 255 " + pixels());
  ASSERT_TRUE(commented) << commented.error().text();
  EXPECT_EQ(commented->labels, pixels());
}

TEST(LabelImage, HasTheSizeOfAnyCamera) {
  for (const auto& [width_px, height_px] : {std::pair{1, 1}, {848, 480}, {1280, 800}}) {
    const std::string labels(static_cast<std::size_t>(width_px * height_px), '\3');
    const auto image =
        loaded("P5 " + std::to_string(width_px) + " " + std::to_string(height_px) + " 255\n" + labels);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->width_px, width_px);
    EXPECT_EQ(image->height_px, height_px);
    EXPECT_EQ(image->labels, labels);
  }
}

TEST(LabelImage, IsRefusedWithTheReasonAndARemedy) {
  struct Case {
    std::string content;
    std::string part;
  };
  for (const auto& [content, part] :
       {Case{"", "does not begin with P5"}, Case{"P2\n640 480\n255\n0 0", "does not begin with P5"},
        Case{"P5\n640 x", "damaged header"}, Case{"P5\n640 480\n", "damaged header"},
        Case{"P5\n1281 480\n255\n" + pixels(), "has 1281 x 480 pixels"},
        Case{"P5\n640 801\n255\n" + pixels(), "has 640 x 801 pixels"},
        Case{"P5\n0 480\n255\n", "has 0 x 480 pixels"}, Case{"P5\n-640 480\n255\n", "has -640 x 480 pixels"},
        Case{"P5\n320 240\n255\n" + pixels(), "has 307200 bytes of pixels, and 76800 are needed"},
        Case{"P5\n640 480\n65535\n" + pixels(), "has the largest value 65535"},
        Case{"P5\n640 480\n255\n" + pixels().substr(1), "has 307199 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + pixels() + "x", "has 307201 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + std::string(2'000'000, 'x'), "is longer than"}}) {
    const auto image = loaded(content);
    ASSERT_FALSE(image) << part;
    EXPECT_NE(image.error().text().find(part), std::string::npos) << image.error().text();
    EXPECT_FALSE(image.error().remedy.empty()) << part;
  }
  EXPECT_FALSE(loadLabelImage("/nowhere/labels.pgm"));
}

}  // namespace
}  // namespace hapticd::config
