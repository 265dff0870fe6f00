# What `cmake --install` puts where. All places are below the prefix, whatever it is, so that an installation
# into a home folder needs no privileges.
include(GNUInstallDirs)

# The folder that pkg-config knows for the prefix /usr, relative to the prefix.
function(find_service_folder result package variable default)
  pkg_get_variable(folder ${package} ${variable})
  string(REGEX REPLACE "^/(usr/)?" "" folder "${folder}")
  if(NOT folder)
    set(folder ${default})
  endif()
  set(${result} ${folder} PARENT_SCOPE)
endfunction()

find_service_folder(unit_folder systemd systemdsystemunitdir lib/systemd/system)
find_service_folder(sysusers_folder systemd sysusersdir lib/sysusers.d)
find_service_folder(tmpfiles_folder systemd tmpfilesdir lib/tmpfiles.d)
find_service_folder(udev_folder udev udevdir lib/udev)
set(doc_folder ${CMAKE_INSTALL_DATAROOTDIR}/doc/hapticd)

# Symbols are resolved at the start: the force thread must not wait for the dynamic linker.
foreach(program hapticd hapticctl haptic-bridge haptic-replay hapticbench)
  target_link_options(${program} PRIVATE LINKER:-z,relro,-z,now)
endforeach()

install(TARGETS hapticd RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/hapticd)
install(TARGETS hapticctl haptic-bridge haptic-replay hapticbench RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})

install(FILES systemd/hapticd-status.socket systemd/hapticd-control.socket systemd/hapticd-metrics.socket DESTINATION ${unit_folder})
install(FILES systemd/hapticd.sysusers DESTINATION ${sysusers_folder} RENAME hapticd.conf)
install(FILES systemd/hapticd.tmpfiles DESTINATION ${tmpfiles_folder} RENAME hapticd.conf)
install(FILES systemd/72-hapticd.rules DESTINATION ${udev_folder}/rules.d)
install(CODE "set(source_folder \"${CMAKE_SOURCE_DIR}\")
  set(unit_folder \"${unit_folder}\")
  set(daemon_folder \"${CMAKE_INSTALL_LIBEXECDIR}/hapticd\")
  set(program_folder \"${CMAKE_INSTALL_BINDIR}\")")
install(SCRIPT tools/packaging/install_by_prefix.cmake)

install(PROGRAMS tools/realtime-setup DESTINATION ${CMAKE_INSTALL_SBINDIR} RENAME hapticd-realtime-setup)

install(FILES ${HAPTICD_GENERATED}/hapticd.8.gz ${HAPTICD_GENERATED}/hapticd-realtime-setup.8.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
install(FILES ${HAPTICD_GENERATED}/hapticd.yaml.5.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man5)
install(FILES ${HAPTICD_GENERATED}/hapticd-varlink.7.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man7)
foreach(program hapticctl haptic-bridge haptic-replay hapticbench)
  install(FILES ${HAPTICD_GENERATED}/${program}.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endforeach()
install(FILES ${HAPTICD_GENERATED}/hapticctl
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions)
install(FILES ${HAPTICD_GENERATED}/_hapticctl DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/zsh/vendor-completions)
install(FILES ${HAPTICD_GENERATED}/hapticctl.fish
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/fish/vendor_completions.d)

install(FILES README.md tools/packaging/copyright ${HAPTICD_GENERATED}/changelog.Debian.gz
        DESTINATION ${doc_folder})
install(FILES drivers/handle/udp/protocol.md DESTINATION ${doc_folder} RENAME udp-protocol.md)
install(FILES drivers/handle/hid/reports.md DESTINATION ${doc_folder} RENAME hid-reports.md)
install(FILES config/demo.yaml systemd/examples/50-cpu.conf systemd/examples/60-udp-peer.conf
        DESTINATION ${doc_folder}/examples)
