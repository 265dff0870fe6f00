// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/settings_summary.h"
#include "drivers/handle/udp/udp_settings.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

Settings udpSettings(const char* address, const char* peer, const char* key_file = "") {
  Settings settings;
  settings.handle.driver = "udp";
  settings.handle.of<drivers::UdpHandleSettings>().address = address;
  settings.handle.of<drivers::UdpHandleSettings>().peer = peer;
  settings.handle.of<drivers::UdpHandleSettings>().key_file = key_file;
  return settings;
}

TEST(Warnings, AreEmptyForTheDefaults) {
  EXPECT_TRUE(warningsOf(Settings{}).empty());
}

TEST(Warnings, NameAHandleOnTheNetworkWithoutAKey) {
  for (const auto& settings :
       {udpSettings("0.0.0.0", "192.0.2.10"), udpSettings("192.0.2.1", "192.0.2.10:47801"),
        udpSettings("0.0.0.0", "127.0.0.1")}) {
    const std::vector<base::Error> warnings = warningsOf(settings);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].where, "udp_handle.key_file");
    EXPECT_NE(warnings[0].text().find(settings.handle.of<drivers::UdpHandleSettings>().peer),
              std::string::npos);
  }
}

TEST(Warnings, AreEmptyForAHandleWithAKeyOnThisComputerOrNotInUse) {
  EXPECT_TRUE(warningsOf(udpSettings("0.0.0.0", "192.0.2.10", "/etc/hapticd/key")).empty());
  EXPECT_TRUE(warningsOf(udpSettings("127.0.0.1", "127.0.0.2:47801")).empty());
  Settings unused = udpSettings("0.0.0.0", "192.0.2.10");
  unused.handle.driver = "simulated";
  EXPECT_TRUE(warningsOf(unused).empty());
}

SettingsSummary summary(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
  const test::TemporaryFolder folder;
  const auto loaded = loadConfiguration(folder.write("a.yaml", yaml), overrides, base::FileKind::regular);
  EXPECT_TRUE(loaded);
  return loaded ? summaryOf(*loaded) : SettingsSummary{};
}

TEST(SettingsSummary, CountsWhatIsSetAndNamesWhatDiffersFromTheDefaults) {
  EXPECT_EQ(summary("force:").text(), "0 parameters set, none differs from the defaults");
  EXPECT_EQ(summary("force: {min_points: 10}").text(), "1 parameter set, none differs from the defaults");
  EXPECT_EQ(
      summary("safety: {max_force_n: 1}\ncamera: {serial: A00362}\nforce: {min_points: 10}\n").text(),
      "3 parameters set, 2 differ from the defaults: safety.max_force_n = 1 (default 4), camera.serial = "
      "\"A00362\" (default \"\")");
}

TEST(SettingsSummary, CountsAParameterOnceThatAnOverrideSetsAgain) {
  EXPECT_EQ(summary("safety: {max_force_n: 1}", {"safety.max_force_n=2", "safety.max_force_n=3"}).text(),
            "1 parameter set, 1 differs from the defaults: safety.max_force_n = 3 (default 4)");
}

TEST(SettingsSummary, IsCutWhenMuchDiffersOrAValueIsLong) {
  Configuration configuration;
  for (const Parameter& parameter : allParameters()) {
    if (parameter.kind == Kind::number) parameter.set(configuration.settings, parameter.maximum);
  }
  const SettingsSummary found = summaryOf(configuration);
  ASSERT_GT(found.differences.size(), 16U);
  EXPECT_TRUE(found.text().ends_with(", and " + std::to_string(found.differences.size() - 16) + " more"))
      << found.text();
  const std::string long_value = summary("force:", {"camera.serial=" + std::string(3000, 'x')}).text();
  EXPECT_TRUE(long_value.ends_with(": camera.serial = \"" + std::string(60, 'x') + "...\" (default \"\")"))
      << long_value;
}

}  // namespace
}  // namespace hapticd::config
