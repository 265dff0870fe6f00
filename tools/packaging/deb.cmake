# The Debian package, made by CPack.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hapticd)
# The project has no mail address; Debian wants the form of one.
set(CPACK_PACKAGE_CONTACT "The hapticd developers <hapticd@hapticd.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "feel a depth camera's scene through a haptic handle")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"A depth camera looks at a scene, a person holds a haptic handle, and hapticd
turns the live depth into forces on the handle, 1000 times a second.

This package holds the daemon with its service, and the programs to steer it
(hapticctl), to join a device on another computer (haptic-bridge), to compute
forces for recorded scenes (haptic-replay) and to measure the force laws
(hapticbench).")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# systemd: for the users too, also where it does not run. udev: what has no devices can do without.
set(CPACK_DEBIAN_PACKAGE_DEPENDS systemd)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS udev)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "gnuplot-nox, rt-tests, stress-ng")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    ${CMAKE_SOURCE_DIR}/tools/packaging/conffiles
    ${CMAKE_SOURCE_DIR}/tools/packaging/postinst
    ${CMAKE_SOURCE_DIR}/tools/packaging/prerm
    ${CMAKE_SOURCE_DIR}/tools/packaging/postrm)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
include(CPack)
