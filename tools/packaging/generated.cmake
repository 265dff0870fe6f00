# SPDX-License-Identifier: Apache-2.0
# What is made at build time only to be installed: manual pages, completions, the compressed changelog.
find_program(GZIP gzip REQUIRED)
set(HAPTICD_GENERATED ${CMAKE_BINARY_DIR}/generated)
file(MAKE_DIRECTORY ${HAPTICD_GENERATED})
set(generated_files)

# add_manual_page(page [PROGRAM program that it describes] [HELPERS what this executes] [INTERFACES Varlink interfaces that it
# describes])
function(add_manual_page page)
  cmake_parse_arguments(PARSE_ARGV 1 PAGE "" "PROGRAM" "HELPERS;INTERFACES")
  set(template ${CMAKE_SOURCE_DIR}/tools/manual/${page}.in)
  set(options)
  if(PAGE_PROGRAM)
    list(APPEND options --program $<TARGET_FILE:${PAGE_PROGRAM}>)
  endif()
  if(PAGE_INTERFACES)
    list(APPEND options --interface ${PAGE_INTERFACES})
  endif()
  add_custom_command(
    OUTPUT ${HAPTICD_GENERATED}/${page} ${HAPTICD_GENERATED}/${page}.gz
    COMMAND $<TARGET_FILE:manual-page> --template ${template} --out ${HAPTICD_GENERATED}/${page} ${options}
    COMMAND ${GZIP} -9nkf ${HAPTICD_GENERATED}/${page}
    DEPENDS manual-page ${PAGE_PROGRAM} ${PAGE_HELPERS} ${PAGE_INTERFACES} ${template}
    COMMENT "Manual page ${page}"
    VERBATIM)
  set(generated_files ${generated_files} ${HAPTICD_GENERATED}/${page}.gz PARENT_SCOPE)
endfunction()

function(add_completion shell file)
  add_custom_command(
    OUTPUT ${HAPTICD_GENERATED}/${file}
    COMMAND $<TARGET_FILE:hapticctl> completion ${shell} > ${HAPTICD_GENERATED}/${file}
    DEPENDS hapticctl
    COMMENT "Completion of ${shell}"
    VERBATIM)
  set(generated_files ${generated_files} ${HAPTICD_GENERATED}/${file} PARENT_SCOPE)
endfunction()

add_manual_page(hapticd.8 PROGRAM hapticd)
add_manual_page(hapticd-view.8 PROGRAM hapticd-view)
add_manual_page(hapticd.yaml.5)
add_manual_page(hapticd-realtime-setup.8)
add_manual_page(hapticd-varlink.7 INTERFACES
  ${CMAKE_SOURCE_DIR}/daemon/control/io.hapticd.Status.varlink
  ${CMAKE_SOURCE_DIR}/daemon/control/io.hapticd.Control.varlink
  ${CMAKE_SOURCE_DIR}/daemon/control/org.varlink.service.varlink)
get_target_property(helpers hapticctl_helpers MANUALLY_ADDED_DEPENDENCIES)
add_manual_page(hapticctl.1 PROGRAM hapticctl HELPERS ${helpers})
add_manual_page(haptic-bridge.1 PROGRAM haptic-bridge)
add_manual_page(haptic-palpate.1 PROGRAM haptic-palpate)
add_manual_page(haptic-replay.1 PROGRAM haptic-replay)
if(HAPTICD_ROS)
  add_manual_page(hapticd-ros.8 PROGRAM hapticd-ros)
  add_manual_page(haptic-crtk-bridge.1 PROGRAM haptic-crtk-bridge)
endif()
if(HAPTICD_BENCH)
  add_manual_page(hapticbench.1 PROGRAM hapticbench)
endif()

add_completion(bash hapticctl)
add_completion(zsh _hapticctl)
add_completion(fish hapticctl.fish)

# add_compressed(source file)
function(add_compressed source file)
  add_custom_command(
    OUTPUT ${HAPTICD_GENERATED}/${file}
    COMMAND ${GZIP} -9nc ${source} > ${HAPTICD_GENERATED}/${file}
    DEPENDS ${source}
    VERBATIM)
  set(generated_files ${generated_files} ${HAPTICD_GENERATED}/${file} PARENT_SCOPE)
endfunction()

add_compressed(${CMAKE_SOURCE_DIR}/tools/packaging/changelog changelog.Debian.gz)
add_compressed(${CMAKE_SOURCE_DIR}/CHANGELOG.md changelog.gz)

# All that an installation needs, and no test.
add_custom_target(installable ALL DEPENDS ${generated_files})
add_dependencies(installable hapticd hapticd-view hapticctl hapticctl_helpers haptic-bridge haptic-palpate haptic-replay)
if(HAPTICD_ROS)
  add_dependencies(installable hapticd-ros haptic-crtk-bridge)
endif()
if(HAPTICD_BENCH)
  add_dependencies(installable hapticbench)
endif()
