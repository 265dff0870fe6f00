# SPDX-License-Identifier: Apache-2.0
# Which targets are compiled several sources at once: most of the time goes into what their headers instantiate, which one
# compilation of eight sources does once. Sources of which two use the same name for themselves are compiled APART. Left out
# are libraries of which programs take single sources, with the libraries that only these need, as config/ and drivers/; and
# rt/, whose kernels are compiled for several processors each.
option(HAPTICD_TOGETHER "Compile several sources at once; OFF for tools that look at single sources, as clangd does" ON)

# hapticd_together(target [APART sources..]): sources by their path from the root.
function(hapticd_together target)
  cmake_parse_arguments(PARSE_ARGV 1 TOGETHER "" "" "APART")
  if(NOT HAPTICD_TOGETHER OR NOT TARGET ${target})
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  list(TRANSFORM TOGETHER_APART PREPEND ${CMAKE_SOURCE_DIR}/)
  if(TOGETHER_APART)
    set_source_files_properties(${TOGETHER_APART} TARGET_DIRECTORY ${target} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

hapticd_together(box_tests)
hapticd_together(config_tests APART
  tests/unit/config/automatic_stiffness_test.cpp
  tests/unit/config/libyaml_reader.cpp
  tests/unit/config/loosening_test.cpp
  tests/unit/config/refusals_test.cpp)
hapticd_together(control_test APART
  tests/unit/daemon/control/addition_methods_test.cpp
  tests/unit/daemon/control/conformance_test.cpp)
hapticd_together(daemon_tests APART
  tests/unit/daemon/indicators_test.cpp
  tests/unit/daemon/recorder/flight_recorder_test.cpp)
hapticd_together(doctor_tests)
hapticd_together(drivers_tests APART
  tests/unit/drivers/analytic_scene_test.cpp
  tests/unit/drivers/camera_noise_test.cpp
  tests/unit/drivers/depth_image_test.cpp
  tests/unit/drivers/edge_errors_test.cpp
  tests/unit/drivers/handle/handle_frame_test.cpp
  tests/unit/drivers/handle/handle_thread_test.cpp
  tests/unit/drivers/handle/udp_handle_test.cpp
  tests/unit/drivers/led_test.cpp)
hapticd_together(emulator_tests)
hapticd_together(hapticctl APART
  tools/hapticctl/additions/addition_commands.cpp
  tools/hapticctl/additions/addition_options.cpp
  tools/hapticctl/additions/fixture_touch.cpp
  tools/hapticctl/additions/model_import.cpp
  tools/hapticctl/base/command_line.cpp
  tools/hapticctl/camera_commands.cpp
  tools/hapticctl/handle_command.cpp
  tools/hapticctl/metrics_command.cpp)
hapticd_together(hapticctl_library_tests)
hapticd_together(hapticctl_tests APART
  tests/system/hapticctl/hapticctl_every_command_test.cpp
  tests/system/hapticctl/hapticctl_view_test.cpp)
hapticd_together(hapticctl_text)
hapticd_together(hapticctl_work APART
  tools/hapticctl/events.cpp)
hapticd_together(hapticd_box_test_support)
hapticd_together(hapticd_bridge)
hapticd_together(hapticd_control APART
  daemon/control/base/addition_change.cpp
  daemon/control/base/feed.cpp
  daemon/control/control_service.cpp
  daemon/control/methods/calibration_methods.cpp
  daemon/control/methods/force_methods.cpp
  daemon/control/methods/frame_methods.cpp
  daemon/control/methods/profile_methods.cpp
  daemon/control/streams/monitor_streams.cpp)
hapticd_together(hapticd_crtk_arm)
hapticd_together(hapticd_daemon APART
  daemon/event_log.cpp
  daemon/journal.cpp
  daemon/realtime_conditions.cpp
  daemon/recorder/flight_recorder.cpp
  daemon/recorder/retention.cpp
  daemon/service.cpp)
hapticd_together(hapticd_device_check)
hapticd_together(hapticd_doctor APART
  tools/hapticctl/doctor/checks.cpp
  tools/hapticctl/doctor/examination.cpp
  tools/hapticctl/doctor/gpio_check.cpp
  tools/hapticctl/doctor/handle_check.cpp)
hapticd_together(hapticd_emulated_uvc APART
  tests/vm/emulators/uvc/orbbec_unit.cpp)
hapticd_together(hapticd_ros_commands)
hapticd_together(hapticd_ros_dds)
hapticd_together(hapticd_ros_messages)
hapticd_together(hapticd_state APART
  daemon/state/profile_folder.cpp)
hapticd_together(hapticd_test_support)
hapticd_together(hapticd_truth APART
  tools/lib/truth/known_solid.cpp)
hapticd_together(hapticd_usbip_emulator APART
  tests/vm/emulators/usbip/control_socket.cpp)
hapticd_together(hapticd_vendor_bridge APART
  tools/haptic-vendor-bridge/inverse3/driven_device.cpp
  tools/haptic-vendor-bridge/inverse3/inverse3_driver.cpp
  tools/haptic-vendor-bridge/inverse3/service_link.cpp)
hapticd_together(hapticd_view_server APART
  tools/hapticd-view/server/socket_progress.cpp)
hapticd_together(hard_study_tests)
hapticd_together(installation_tests)
hapticd_together(layering_tests APART
  tests/layering/folder_rules.cpp
  tests/layering/folder_rules_test.cpp
  tests/layering/realtime_rules_test.cpp)
hapticd_together(phantom_omni_tests APART
  tests/vendor_devices/phantom_omni/omni_calibrate_test.cpp)
hapticd_together(realtime_tests APART
  tests/rt/external_force_test.cpp
  tests/rt/fixture_core_test.cpp
  tests/rt/force_loop_test.cpp
  tests/rt/safety_chain_test.cpp
  tests/rt/stopping_test.cpp)
hapticd_together(registration_tests APART
  tests/unit/tools/model_registration_test.cpp
  tests/unit/tools/rigid_fit_test.cpp)
hapticd_together(ros_view_tests APART
  tests/ros/box_view_test.cpp)
hapticd_together(ros_wire_tests)
hapticd_together(rt_tests APART
  tests/unit/rt/contact_model_test.cpp
  tests/unit/rt/edge_force_test.cpp
  tests/unit/rt/fixtures/closed_forms_test.cpp
  tests/unit/rt/fixtures/frame_sources_test.cpp
  tests/unit/rt/fixtures/guidance_test.cpp
  tests/unit/rt/fixtures/moving_frame_test.cpp
  tests/unit/rt/fixtures/slow_zone_test.cpp
  tests/unit/rt/force_blend_test.cpp
  tests/unit/rt/hard_input_force_test.cpp
  tests/unit/rt/plane_force_test.cpp
  tests/unit/rt/scene/depth_model_test.cpp
  tests/unit/rt/scene/occlusion_memory_test.cpp
  tests/unit/rt/sphere_force_test.cpp)
hapticd_together(solids_tests APART
  tests/unit/tools/solids/label_reader_test.cpp
  tests/unit/tools/solids/mesh_field_test.cpp)
hapticd_together(state_test)
hapticd_together(system_tests APART
  tests/system/fakenect_daemon_test.cpp)
hapticd_together(tools_tests)
hapticd_together(trace_tests APART
  tests/unit/daemon/trace/other_writers_test.cpp)
hapticd_together(vendor_arms_tests APART
  tests/vendor_devices/force_dimension_test.cpp)
hapticd_together(view_bridge_tests)
hapticd_together(view_bridge_unit_tests APART
  tests/view_bridge/box_link_test.cpp
  tests/view_bridge/live_session_test.cpp)
