# SPDX-License-Identifier: Apache-2.0
# Runs at installation, when the prefix is known. Set before: source_folder, unit_folder, program_folder.
set(HAPTICD_ROS_PROGRAM ${CMAKE_INSTALL_PREFIX}/${program_folder}/hapticd-ros)
set(place ${CMAKE_INSTALL_PREFIX}/${unit_folder}/hapticd-ros.service)
message(STATUS "Installing: $ENV{DESTDIR}${place}")
configure_file(${source_folder}/systemd/hapticd-ros.service.in $ENV{DESTDIR}${place} @ONLY
               FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
list(APPEND CMAKE_INSTALL_MANIFEST_FILES ${place})
