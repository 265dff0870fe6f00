# SPDX-License-Identifier: Apache-2.0
# Which targets are compiled several sources at once: most of the time goes into what their headers instantiate, which one
# compilation of eight sources does once. Sources of which two use the same name for themselves are compiled APART from the
# others, and from each other where `--` stands between them. Of libraries of which programs take single sources, with the
# libraries that only these need, only SETS are compiled together. Left out is rt/, whose kernels are compiled for several
# processors each.
option(HAPTICD_TOGETHER "Compile several sources at once; OFF for tools that look at single sources, as clangd does" ON)

# hapticd_together(target [APART|SETS sources.. [-- sources..]..]): sources by their path from the root. APART: the others
# are compiled eight at once; SETS: alone.
function(hapticd_together target)
  cmake_parse_arguments(PARSE_ARGV 1 TOGETHER "" "" "APART;SETS")
  if(NOT HAPTICD_TOGETHER OR NOT TARGET ${target})
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  set(set 0)
  set(apart)
  foreach(source IN LISTS TOGETHER_APART TOGETHER_SETS ITEMS --)
    if(NOT source STREQUAL "--")
      list(APPEND apart ${CMAKE_SOURCE_DIR}/${source})
      list(APPEND sources_of_set ${CMAKE_SOURCE_DIR}/${source})
      continue()
    endif()
    list(LENGTH sources_of_set count)
    if(count GREATER 1)
      set_source_files_properties(${sources_of_set} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP set${set})
    endif()
    math(EXPR set "${set} + 1")
    set(sources_of_set)
  endforeach()
  if(TOGETHER_SETS)
    # an included source is no header
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
    return()
  endif()
  get_target_property(folder ${target} SOURCE_DIR)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  set(index 0)
  foreach(source IN LISTS sources)
    get_filename_component(path ${source} ABSOLUTE BASE_DIR ${folder})
    if(NOT path IN_LIST apart)
      math(EXPR batch "${index} / 8")
      math(EXPR index "${index} + 1")
      set_source_files_properties(${path} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP batch${batch})
    endif()
  endforeach()
endfunction()

hapticd_together(bench_tests APART
  tests/unit/tools/bench/accuracy_study_test.cpp
  tests/unit/tools/bench/camera_recordings_test.cpp
  tests/unit/tools/bench/jitter_test.cpp
  tests/unit/tools/bench/measures_test.cpp
  tests/unit/tools/bench/noise_floor_test.cpp
  tests/unit/tools/bench/noise_statistics_test.cpp
  tests/unit/tools/bench/pareto_test.cpp
  tests/unit/tools/bench/stability_test.cpp
  --
  tests/unit/tools/bench/distance_scene_test.cpp
  tests/unit/tools/bench/occlusion_test.cpp
  tests/unit/tools/bench/played_noise_test.cpp
  tests/unit/tools/bench/report_drawing_test.cpp
  tests/unit/tools/bench/solids_study_test.cpp
  --
  tests/unit/tools/bench/recordings_test.cpp
  tests/unit/tools/bench/stroke_judge_test.cpp
  tests/unit/tools/bench/true_body_test.cpp)
hapticd_together(box_tests)
hapticd_together(config_tests APART
  tests/unit/config/parameters_test.cpp
  tests/unit/config/second_reader_test.cpp
  --
  tests/unit/config/loosening_test.cpp
  --
  tests/unit/config/refusals_test.cpp)
hapticd_together(control_test APART
  tests/unit/daemon/control/additions_test.cpp
  tests/unit/daemon/control/conformance_test.cpp)
hapticd_together(daemon_tests APART
  tests/unit/daemon/indicators_test.cpp
  tests/unit/daemon/recorder/flight_recorder_test.cpp)
hapticd_together(doctor_tests)
hapticd_together(drivers_tests APART
  tests/unit/drivers/camera_noise_test.cpp
  tests/unit/drivers/handle/handle_frame_test.cpp
  tests/unit/drivers/handle/handle_thread_test.cpp
  tests/unit/drivers/led_test.cpp
  tests/unit/drivers/synthetic_camera_test.cpp
  --
  tests/unit/drivers/handle/udp_handle_test.cpp
  tests/unit/drivers/recorded_files_test.cpp
  --
  tests/unit/drivers/edge_errors_test.cpp
  --
  tests/unit/drivers/handle/led_hand_test.cpp)
hapticd_together(emulator_tests)
hapticd_together(hapticctl)
hapticd_together(hapticctl_additions)
hapticd_together(hapticctl_command_line)
hapticd_together(hapticctl_library_tests)
hapticd_together(hapticctl_tests APART
  tests/system/hapticctl/hapticctl_every_command_test.cpp
  --
  tests/system/hapticctl/hapticctl_with_others_test.cpp)
hapticd_together(hapticctl_text)
hapticd_together(hapticctl_work)
hapticd_together(hapticd_bench SETS
  tools/hapticbench/accuracy.cpp
  tools/hapticbench/buzz.cpp
  tools/hapticbench/pareto.cpp
  tools/hapticbench/pareto_report.cpp
  tools/hapticbench/recordings.cpp
  --
  tools/hapticbench/contact.cpp
  tools/hapticbench/strokes/strokes.cpp
  tools/hapticbench/tracking.cpp
  --
  tools/hapticbench/disparity.cpp
  tools/hapticbench/occlusion/entries.cpp
  tools/hapticbench/fixtures.cpp
  tools/hapticbench/noise.cpp
  tools/hapticbench/passed_places.cpp
  --
  tools/hapticbench/resting_surfaces.cpp
  tools/hapticbench/strokes/stroke_cases.cpp
  tools/hapticbench/strokes/stroke_run.cpp
  --
  tools/hapticbench/godobject/godobject.cpp
  tools/hapticbench/godobject/scene_cases.cpp
  tools/hapticbench/godobject/scene_run.cpp
  --
  tools/hapticbench/cameras.cpp
  tools/hapticbench/jitter_loop.cpp
  tools/hapticbench/occlusion/occlusion.cpp
  tools/hapticbench/stability.cpp
  --
  tools/hapticbench/contenders.cpp
  tools/hapticbench/cost.cpp
  tools/hapticbench/engine/measures.cpp
  tools/hapticbench/jitter.cpp
  --
  tools/hapticbench/engine/laws.cpp
  tools/hapticbench/engine/report.cpp
  tools/hapticbench/engine/sequences.cpp
  tools/hapticbench/engine/study.cpp
  --
  tools/hapticbench/solids/bodies.cpp
  tools/hapticbench/solids/solid_cost.cpp
  tools/hapticbench/solids/solids.cpp)
hapticd_together(hapticd_box_test_support)
hapticd_together(hapticd_bridge)
hapticd_together(hapticd_client)
hapticd_together(hapticd_config SETS
  config/additions/addition_checks.cpp
  config/additions/addition_conversion.cpp
  config/additions/addition_fields.cpp
  config/additions/addition_reader.cpp
  --
  config/settings/cause_text.cpp
  config/settings/depth_cameras.cpp
  config/settings/label_image.cpp
  config/settings/law_choice.cpp
  config/settings/line_address.cpp
  config/settings/parameter.cpp
  config/settings/parameter_table.cpp
  config/settings/settings.cpp
  --
  config/settings/yaml_text.cpp
  config/yaml/yaml_reader.cpp
  config/yaml/yaml_source.cpp
  config/yaml_loader.cpp
  --
  config/conflicts.cpp
  config/settings_summary.cpp
  config/solids/solid_file.cpp
  config/solids/solid_outline.cpp)
hapticd_together(hapticd_control APART
  daemon/control/base/addition_change.cpp
  daemon/control/base/feed.cpp
  daemon/control/control_service.cpp
  daemon/control/methods/calibration_methods.cpp
  daemon/control/methods/force_methods.cpp
  daemon/control/methods/frame_methods.cpp
  --
  daemon/control/methods/hand_methods.cpp
  daemon/control/methods/profile_methods.cpp
  daemon/control/streams/status_streams.cpp)
hapticd_together(hapticd_crtk_arm)
hapticd_together(hapticd_daemon APART
  daemon/box_warnings.cpp
  daemon/journal.cpp
  daemon/recorder/flight_recorder.cpp
  daemon/service.cpp
  --
  daemon/recorder/retention.cpp)
hapticd_together(hapticd_device_check)
hapticd_together(hapticd_doctor APART
  tools/hapticctl/doctor/checks.cpp
  tools/hapticctl/doctor/examination.cpp)
hapticd_together(hapticd_drivers SETS
  drivers/camera/synthetic/analytic_scene.cpp
  drivers/camera/synthetic/depth_sensor.cpp
  drivers/camera/synthetic/edge_errors.cpp
  drivers/camera/synthetic/scene_camera.cpp
  drivers/camera/synthetic/synthetic_camera.cpp
  --
  drivers/camera/synthetic/noise_pattern.cpp
  drivers/camera/synthetic/sensor_noise.cpp
  --
  drivers/handle/falcon/falcon_arm.cpp
  drivers/handle/falcon/falcon_handle.cpp
  drivers/handle/falcon/ftdi_port.cpp
  --
  drivers/handle/hid/hid_controller.cpp
  drivers/handle/hid/hid_handle.cpp
  drivers/handle/hid/hid_spacemouse.cpp
  drivers/handle/hid/hidapi_port.cpp
  --
  drivers/handle/simulated/simulated_hand.cpp
  drivers/handle/simulated/simulated_handle.cpp
  --
  drivers/handle/udp/conversation.cpp
  drivers/handle/udp/packet.cpp
  drivers/handle/udp/udp_handle.cpp
  drivers/handle/udp/udp_socket.cpp)
hapticd_together(hapticd_emulated_uvc APART
  tests/vm/emulators/uvc/orbbec_unit.cpp)
hapticd_together(hapticd_message_set)
hapticd_together(hapticd_ros_commands)
hapticd_together(hapticd_ros_dds)
hapticd_together(hapticd_ros_messages)
hapticd_together(hapticd_snapshot)
hapticd_together(hapticd_state APART
  daemon/state/profile_folder.cpp)
hapticd_together(hapticd_test_support)
hapticd_together(hapticd_trace SETS
  daemon/trace/format/additions.cpp
  daemon/trace/format/depth_codec.cpp
  daemon/trace/format/messages.cpp
  daemon/trace/format/trace_format.cpp
  daemon/trace/mcap/mcap_reader.cpp
  daemon/trace/reader/trace_folder.cpp
  --
  daemon/trace/mcap/mcap_format.cpp
  daemon/trace/recovery/salvage.cpp
  daemon/trace/mcap/mcap_writer.cpp
  daemon/trace/reader/trace_reader.cpp
  daemon/trace/recovery/trace_recovery.cpp
  --
  daemon/trace/mcap/trace_file.cpp
  daemon/trace/writer/trace_writer.cpp)
hapticd_together(hapticd_trace_export)
hapticd_together(hapticd_truth APART
  tools/lib/truth/known_solid.cpp)
hapticd_together(hapticd_usbip_emulator APART
  tests/vm/emulators/usbip/control_socket.cpp)
hapticd_together(hapticd_v4l2 SETS
  drivers/camera/v4l2/camera_report.cpp
  drivers/camera/v4l2/orbbec_messages.cpp
  drivers/camera/v4l2/pinhole.cpp
  drivers/camera/v4l2/video_devices.cpp
  --
  drivers/camera/v4l2/capture_stream.cpp
  drivers/camera/v4l2/realsense_messages.cpp)
hapticd_together(hapticd_vendor_bridge APART
  tools/haptic-bridge/inverse3/inverse3_driver.cpp
  --
  tools/haptic-bridge/inverse3/service_link.cpp
  --
  tools/haptic-bridge/force_dimension.cpp
  --
  tools/haptic-bridge/open_haptics.cpp)
hapticd_together(hapticd_view_server APART
  tools/hapticd-view/server/socket_progress.cpp)
hapticd_together(hard_case_tests APART
  tests/hard_cases/long_run_test.cpp
  tests/hard_cases/proxy_stroke_test.cpp
  --
  tests/hard_cases/passive_hand_test.cpp
  --
  tests/hard_cases/standoff_test.cpp)
hapticd_together(hard_study_tests)
hapticd_together(installation_tests)
hapticd_together(phantom_omni_tests APART
  tests/vendor_devices/phantom_omni/omni_calibration_test.cpp)
hapticd_together(realtime_tests APART
  tests/rt/fixture_core_test.cpp
  --
  tests/rt/force_loop_test.cpp
  --
  tests/rt/safety_chain_test.cpp
  --
  tests/rt/stopping_test.cpp
  --
  tests/rt/external_force_test.cpp)
hapticd_together(registration_tests APART
  tests/unit/tools/model_registration_test.cpp
  --
  tests/unit/tools/rigid_fit_test.cpp)
hapticd_together(ros_view_tests APART
  tests/ros/box_view_test.cpp)
hapticd_together(ros_wire_tests)
hapticd_together(rt_tests APART
  tests/unit/rt/contact_model_test.cpp
  tests/unit/rt/fixtures/guidance_test.cpp
  tests/unit/rt/scene/column_shifts_test.cpp
  tests/unit/rt/sphere_force_test.cpp
  --
  tests/unit/rt/fixtures/margins_test.cpp
  tests/unit/rt/scene/depth_model_test.cpp
  --
  tests/unit/rt/fixtures/frame_sources_test.cpp
  tests/unit/rt/reference_force_test.cpp
  --
  tests/unit/rt/laws_test.cpp
  tests/unit/rt/scene/focus_test.cpp
  --
  tests/unit/rt/fixtures/closed_forms_test.cpp)
hapticd_together(solids_tests APART
  tests/unit/tools/solids/label_reader_test.cpp
  tests/unit/tools/solids/mesh_field_test.cpp)
hapticd_together(state_test)
hapticd_together(system_tests APART
  tests/system/fakenect_daemon_test.cpp)
hapticd_together(tools_tests)
hapticd_together(trace_tests APART
  tests/unit/daemon/trace/other_writers_test.cpp)
hapticd_together(vendor_arms_tests)
hapticd_together(view_bridge_tests APART
  tests/view_bridge/hand_rights_test.cpp)
hapticd_together(view_bridge_unit_tests APART
  tests/view_bridge/hand_moves_test.cpp
  --
  tests/view_bridge/box_link_test.cpp
  tests/view_bridge/live_session_test.cpp)
