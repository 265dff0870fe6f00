// SPDX-License-Identifier: Apache-2.0
// The shipped configuration and the documentation show every member of fixtures and regions with its range.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "config/additions/addition_fields.h"
#include "tests/support/file_content.h"

namespace hapticd::config {
namespace {

const std::string kSource = HAPTICD_SOURCE;

/// The section of the shipped configuration from `fixtures:` on, without its comment marks.
std::string shippedSection() {
  std::istringstream lines(test::contentOf(kSource + "/config/hapticd.yaml"));
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') && (!section.empty() || line == "# fixtures:"))
      section += line.substr(2) + "\n";
  }
  return section;
}

std::string listOf(const std::string& section, const AdditionType& type) {
  const std::size_t frames = section.find("\nframes:");
  const std::size_t regions = section.find("\nregions:");
  if (type.noun == "fixture") return section.substr(0, frames);
  return type.noun == "frame" ? section.substr(frames, regions - frames) : section.substr(regions);
}

void expectEveryMember(const AdditionType& type) {
  const std::string section = listOf(shippedSection(), type);
  for (const AdditionField& field : type.fields) {
    const std::size_t name = section.find(" " + std::string(field.name) + ": ");
    ASSERT_NE(name, std::string::npos) << field.name;
    const std::string line = section.substr(name, section.find('\n', name) - name);
    // a member of several kinds has its range where it is first
    EXPECT_TRUE(line.ends_with("  # " + rangeOf(field))) << line << "\n" << rangeOf(field);
  }
}

TEST(ShippedFixtures, ShowEveryMemberWithItsRange) {
  expectEveryMember(typeOf(FixtureSettings{}));
  expectEveryMember(typeOf(RegionSettings{}));
  expectEveryMember(typeOf(FrameSettings{}));
}

TEST(ShippedFixtures, LoadWithEveryCommentMarkDeleted) {
  const auto additions = additionsFromText(shippedSection(), "hapticd.yaml");
  ASSERT_TRUE(additions) << additions.error().front().error.text();
  EXPECT_EQ(additions->fixtures.size(), rt::kWords<rt::FixtureKind>.size() + 1) << "and one that slows";
  EXPECT_EQ(additions->regions.size(), 3U);
  EXPECT_EQ(additions->frames.size(), 1U);
}

TEST(FixturesDocument, ShowsAnExampleThatLoads) {
  const std::string document = test::contentOf(kSource + "/docs/fixtures.md");
  const std::size_t reference = document.find("## Reference");
  const std::size_t begin = document.find("```yaml\n", reference) + 8;
  const auto additions =
      additionsFromText(document.substr(begin, document.find("```", begin) - begin), "example");
  ASSERT_TRUE(additions) << additions.error().front().error.text();
  EXPECT_EQ(additions->fixtures.size(), 3U);
}

TEST(FixturesDocument, ShowsMarginsAndASlowingRegionThatLoad) {
  const std::string document = test::contentOf(kSource + "/docs/fixtures.md");
  for (const std::string heading : {"### Margins and breaches", "### Regions that slow the hand"}) {
    const std::size_t begin = document.find("```yaml\n", document.find(heading)) + 8;
    const auto additions = additionsFromText(
        "fixtures:\n" + document.substr(begin, document.find("```", begin) - begin), "example");
    ASSERT_TRUE(additions) << additions.error().front().error.text();
    EXPECT_EQ(additions->fixtures.size(), 1U);
  }
}

}  // namespace
}  // namespace hapticd::config
