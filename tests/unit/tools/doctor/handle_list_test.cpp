// SPDX-License-Identifier: Apache-2.0
// `hapticctl handle list` on synthetic files of /sys.
#include "tools/hapticctl/doctor/handle_list.h"

#include <nlohmann/json.hpp>

#include "doctor_fixture.h"

namespace hapticd::tools {
namespace {

class HandleListing : public DoctorOnFiles {
 protected:
  void addUsbDevice(const std::string& name, const std::string& vendor, const std::string& product) const {
    const std::string folder = "sys/bus/usb/devices/" + name + "/";
    files.set(folder + "idVendor", vendor);
    files.set(folder + "idProduct", product);
    files.set(folder + "busnum", "2");
    files.set(folder + "devnum", "5");
  }
  ConnectedHandle only() const {
    const HandleList found = listHandles(box);
    EXPECT_EQ(found.handles.size(), 1U) << textOf(found);
    return found.handles.empty() ? ConnectedHandle{} : found.handles.front();
  }
};

TEST_F(HandleListing, SaysWhatToDoForEachHandleThatIsKnown) {
  EXPECT_EQ(textOf(listHandles(box)).find("no handle that hapticd knows is connected\n"), 0U);
  addUsbDevice("1-1", "1451", "0402");
  addUsbDevice("1-2", "2988", "0302");
  addUsbDevice("1-3", "0403", "cb48");
  addUsbDevice("1-4", "0403", "6001");  // another device of the Falcon's vendor
  files.set("sys/bus/firewire/devices/fw1/vendor", "0x000b99");
  files.set("sys/bus/firewire/devices/fw0/vendor", "0x00d1a2");
  files.set("usr/lib/systemd/system/haply-inverse-service.service", "[Unit]");
  const std::string text = textOf(listHandles(box));
  EXPECT_NE(
      text.find(
          "usable    1451:0402 at 1-1: Force Dimension omega, delta, sigma or lambda (set handle.driver "
          "to udp and run haptic-vendor-bridge force-dimension)\n"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("2988:0302 at 1-2: 3D Systems Touch or Touch X (set handle.driver to udp and run "
                      "haptic-vendor-bridge openhaptics)\n"),
            std::string::npos);
  EXPECT_NE(text.find("/dev/fw1: SensAble Phantom on FireWire"), std::string::npos);
  EXPECT_NE(
      text.find("Haply Inverse Service (set handle.driver to udp and run haptic-vendor-bridge inverse3)"),
      std::string::npos);
  EXPECT_EQ(text.find("6001"), std::string::npos);
  EXPECT_EQ(text.find("fw0"), std::string::npos);
}

TEST_F(HandleListing, NamesTheHandleThatIsUsed) {
  addUsbDevice("1-3", "0403", "cb48");
  EXPECT_EQ(only().suitability, Suitability::usable);
  EXPECT_EQ(only().note, "set handle.driver to falcon");
  box.configuration.settings.handle.driver = "falcon";
  EXPECT_EQ(only().suitability, Suitability::used);
  EXPECT_EQ(only().note, "");
}

TEST_F(HandleListing, IsForProgramsTheSame) {
  addUsbDevice("1-1", "1451", "0402");
  box.configuration.settings.handle.driver = "udp";
  HandleList list = listHandles(box);
  list.state = "present";
  const auto json = nlohmann::json::parse(jsonOf(list));
  EXPECT_EQ(json["source"], "udp");
  EXPECT_EQ(json["state"], "present");
  ASSERT_EQ(json["handles"].size(), 1U);
  EXPECT_EQ(json["handles"][0]["driver"], "udp");
  EXPECT_EQ(json["handles"][0]["suitability"], "usable");
}

}  // namespace
}  // namespace hapticd::tools
