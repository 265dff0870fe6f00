# SPDX-License-Identifier: Apache-2.0
# Runs at installation: only then the prefix is known, which `cmake --install --prefix` and packaging choose.
# Set before: source_folder, unit_folder, rules_folder, daemon_folder, program_folder.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(configuration_folder /etc/hapticd)
else()
  set(configuration_folder ${CMAKE_INSTALL_PREFIX}/etc/hapticd)
endif()

set(HAPTICD_PROGRAM ${CMAKE_INSTALL_PREFIX}/${daemon_folder}/hapticd)
set(HAPTICD_CONFIGURATION ${configuration_folder}/hapticd.yaml)
set(HAPTICCTL_PROGRAM ${CMAKE_INSTALL_PREFIX}/${program_folder}/hapticctl)
set(HAPTICD_VIEW_PROGRAM ${CMAKE_INSTALL_PREFIX}/${program_folder}/hapticd-view)
foreach(file ${unit_folder}/hapticd.service ${unit_folder}/hapticd-metrics@.service ${unit_folder}/hapticd-view.service
             ${unit_folder}/hapticd-view.socket ${rules_folder}/72-hapticd.rules)
  get_filename_component(name ${file} NAME)
  set(place ${CMAKE_INSTALL_PREFIX}/${file})
  message(STATUS "Installing: $ENV{DESTDIR}${place}")
  configure_file(${source_folder}/systemd/${name}.in $ENV{DESTDIR}${place} @ONLY
                 FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES ${place})
endforeach()

if(EXISTS $ENV{DESTDIR}${HAPTICD_CONFIGURATION})
  message(STATUS "Kept: $ENV{DESTDIR}${HAPTICD_CONFIGURATION}")
else()
  file(INSTALL DESTINATION ${configuration_folder} TYPE FILE FILES ${source_folder}/config/hapticd.yaml)
endif()
