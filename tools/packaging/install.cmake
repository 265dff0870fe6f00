# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where. All places are below the prefix, whatever it is, so that an installation
# into a home folder needs no privileges. The components become packages (deb.cmake): `hapticd` is what a box needs,
# `tools` is for studies of it, on any machine, `ros` for those who use ROS 2, `python` for those who use it from Python.
include(GNUInstallDirs)

# Where systemd and udev look below /usr, on every system with merged folders.
set(unit_folder lib/systemd/system)
set(sysusers_folder lib/sysusers.d)
set(tmpfiles_folder lib/tmpfiles.d)
set(udev_folder lib/udev)
set(doc_folder ${CMAKE_INSTALL_DATAROOTDIR}/doc/hapticd)

set(bench)
if(HAPTICD_BENCH)
  set(bench hapticbench)
endif()

set(ros)
if(HAPTICD_ROS)
  set(ros hapticd-ros haptic-crtk-bridge)
endif()

# Symbols are resolved at the start: the force thread must not wait for the dynamic linker.
foreach(program hapticd hapticd-view hapticctl ${helpers} haptic-bridge haptic-palpate haptic-replay ${bench} ${ros})
  target_link_options(${program} PRIVATE LINKER:-z,relro,-z,now)
endforeach()

install(TARGETS hapticd ${helpers} RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/hapticd COMPONENT hapticd)
install(TARGETS hapticd-view RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT hapticd)
install(DIRECTORY tools/hapticd-view/page/ DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/hapticd/view COMPONENT hapticd
        FILES_MATCHING PATTERN *.html PATTERN *.js PATTERN *.css PATTERN *.svg)
install(TARGETS hapticctl haptic-bridge RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT hapticd)
install(FILES ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/haptic-vendor-bridge DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT hapticd)
install(TARGETS haptic-palpate haptic-replay ${bench} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)

install(FILES systemd/hapticd-status.socket systemd/hapticd-control.socket systemd/hapticd-metrics.socket
        DESTINATION ${unit_folder} COMPONENT hapticd)
install(FILES systemd/hapticd.sysusers DESTINATION ${sysusers_folder} RENAME hapticd.conf COMPONENT hapticd)
install(FILES systemd/hapticd.tmpfiles DESTINATION ${tmpfiles_folder} RENAME hapticd.conf COMPONENT hapticd)
install(CODE "set(source_folder \"${CMAKE_SOURCE_DIR}\")
  set(unit_folder \"${unit_folder}\")
  set(rules_folder \"${udev_folder}/rules.d\")
  set(daemon_folder \"${CMAKE_INSTALL_LIBEXECDIR}/hapticd\")
  set(program_folder \"${CMAKE_INSTALL_BINDIR}\")" COMPONENT hapticd)
install(SCRIPT tools/packaging/install_by_prefix.cmake COMPONENT hapticd)

install(PROGRAMS tools/realtime-setup DESTINATION ${CMAKE_INSTALL_SBINDIR} RENAME hapticd-realtime-setup
        COMPONENT hapticd)

# install_manual_pages(component section page...)
function(install_manual_pages component section)
  foreach(page ${ARGN})
    install(FILES ${HAPTICD_GENERATED}/${page}.${section}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section}
            COMPONENT ${component})
  endforeach()
endfunction()

install_manual_pages(hapticd 8 hapticd hapticd-realtime-setup hapticd-view)
install_manual_pages(hapticd 5 hapticd.yaml)
install_manual_pages(hapticd 7 hapticd-varlink)
install_manual_pages(hapticd 1 hapticctl haptic-bridge)
install_manual_pages(tools 1 haptic-palpate haptic-replay ${bench})

install(FILES ${HAPTICD_GENERATED}/hapticctl
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions COMPONENT hapticd)
install(FILES ${HAPTICD_GENERATED}/_hapticctl
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/zsh/vendor-completions COMPONENT hapticd)
install(FILES ${HAPTICD_GENERATED}/hapticctl.fish
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/fish/vendor_completions.d COMPONENT hapticd)

# What Debian wants of each package.
function(install_documents component package)
  install(FILES tools/packaging/copyright ${HAPTICD_GENERATED}/changelog.Debian.gz
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package} COMPONENT ${component})
endfunction()

install_documents(hapticd hapticd)
install_documents(tools hapticd-tools)
install_documents(python python3-hapticd)
install(DIRECTORY tools/python/hapticd DESTINATION lib/python3/dist-packages COMPONENT python
        FILES_MATCHING PATTERN *.py PATTERN py.typed PATTERN __pycache__ EXCLUDE)
if(HAPTICD_ROS)
  install(TARGETS hapticd-ros haptic-crtk-bridge RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ros)
  install_manual_pages(ros 8 hapticd-ros)
  install_manual_pages(ros 1 haptic-crtk-bridge)
  install_documents(ros hapticd-ros)
  install(CODE "set(source_folder \"${CMAKE_SOURCE_DIR}\")
    set(unit_folder \"${unit_folder}\")
    set(program_folder \"${CMAKE_INSTALL_BINDIR}\")" COMPONENT ros)
  install(SCRIPT tools/packaging/install_ros_unit.cmake COMPONENT ros)
endif()
install(PROGRAMS tools/slurm DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/hapticd-tools/examples COMPONENT tools)
install(FILES README.md DESTINATION ${doc_folder} COMPONENT hapticd)
install(FILES ${HAPTICD_GENERATED}/changelog.gz DESTINATION ${doc_folder} COMPONENT hapticd)
set(documents README architecture cameras cluster comparison control-api faults fixtures glossary handles hardware licensing live-view measurements patents recipes ros2 ros2-check
    traces viewers)
list(TRANSFORM documents PREPEND docs/)
list(TRANSFORM documents APPEND .md)
install(FILES ${documents} docs/box.svg docs/pareto.svg docs/view.png DESTINATION ${doc_folder}/docs COMPONENT hapticd)
install(FILES drivers/handle/udp/protocol.md DESTINATION ${doc_folder} RENAME udp-protocol.md COMPONENT hapticd)
install(FILES drivers/handle/hid/reports.md DESTINATION ${doc_folder} RENAME hid-reports.md COMPONENT hapticd)
install(FILES docs/examples/d435.yaml docs/examples/depth.py docs/examples/device.py docs/examples/forces.c docs/examples/forces.py
              docs/examples/hdf5_from_trace.py docs/examples/recording_from_images.py docs/examples/ticks.py DESTINATION ${doc_folder}/examples COMPONENT hapticd)
install(FILES config/demo.yaml config/demo-fixtures.yaml systemd/examples/50-cpu.conf systemd/examples/60-udp-peer.conf systemd/examples/70-mail.conf
              systemd/examples/73-vendor-handles.rules systemd/examples/haptic-bridge.service
              systemd/examples/hapticd-alerts.yml systemd/examples/hapticd-check.service systemd/examples/hapticd-check.timer systemd/examples/hapticd-mail.service
        DESTINATION ${doc_folder}/examples COMPONENT hapticd)
