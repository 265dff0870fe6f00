# SPDX-License-Identifier: Apache-2.0
# The Debian packages, made by CPack of the components of install.cmake: `hapticd` for the box, `hapticd-tools` for what
# studies it, `hapticd-ros` for ROS 2, which brings libraries that a box does not need, `python3-hapticd` for programs of
# users. The test debian_package_test.cpp states which packages each may depend on.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hapticd)
# The project has no mail address; Debian wants the form of one.
set(CPACK_PACKAGE_CONTACT "The hapticd developers <hapticd@hapticd.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
# Each package has its own, as the first line of its description.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(ros_component)
if(HAPTICD_ROS)
  set(ros_component ros)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL hapticd tools python ${ros_component})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_HAPTICD_PACKAGE_NAME hapticd)
set(CPACK_DEBIAN_HAPTICD_PACKAGE_SECTION misc)
set(CPACK_COMPONENT_HAPTICD_DESCRIPTION "feel a depth camera's scene through a haptic handle
A depth camera looks at a scene, a person holds a haptic handle, and hapticd
turns the live depth into forces on the handle, 1000 times a second.

This package holds the daemon with its service, and the programs to steer it
(hapticctl), to look at it live in a browser (hapticd-view) and to join a
device on another computer (haptic-bridge).")
# systemd: for the users too, also where it does not run. udev: what has no devices can do without.
set(CPACK_DEBIAN_HAPTICD_PACKAGE_DEPENDS systemd)
set(CPACK_DEBIAN_HAPTICD_PACKAGE_RECOMMENDS udev)
set(CPACK_DEBIAN_HAPTICD_PACKAGE_SUGGESTS "hapticd-tools, python3-hapticd, gnuplot-nox, acl")
set(CPACK_DEBIAN_HAPTICD_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_HAPTICD_PACKAGE_CONTROL_EXTRA
    ${CMAKE_SOURCE_DIR}/tools/packaging/conffiles
    ${CMAKE_SOURCE_DIR}/tools/packaging/postinst
    ${CMAKE_SOURCE_DIR}/tools/packaging/prerm
    ${CMAKE_SOURCE_DIR}/tools/packaging/postrm)

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME hapticd-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION misc)
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "measure hapticd and compute its forces again
Programs around the haptic controller daemon hapticd that a box does not need:
forces for recorded scenes and traces (haptic-replay), what the force laws cost
and how wrong they are (hapticbench).")
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "hapticd (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS gnuplot-nox)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "rt-tests, stress-ng")
set(CPACK_DEBIAN_TOOLS_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# Of any version of the box, and of any computer: it asks the daemon what it can do. libzstd: for traces.
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-hapticd)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "use the haptic controller daemon hapticd from Python
State, parameters, virtual fixtures, moving frames and every tick of a running
hapticd, traces as arrays of NumPy, and haptic devices of one's own as a
function from force to position.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), libzstd1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-numpy)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "hapticd, python3-pandas")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
    ${CMAKE_SOURCE_DIR}/tools/packaging/python/postinst
    ${CMAKE_SOURCE_DIR}/tools/packaging/python/prerm)

# Without scripts: its unit is there, and an administrator enables it.
set(CPACK_DEBIAN_ROS_PACKAGE_NAME hapticd-ros)
set(CPACK_DEBIAN_ROS_PACKAGE_SECTION misc)
set(CPACK_COMPONENT_ROS_DESCRIPTION "publish what hapticd measures and exerts for ROS 2
The haptic controller daemon hapticd, seen from ROS 2: position, velocity and
force of the hand, operating state, buttons, diagnostics and frames, with the
names of CRTK. It speaks DDS itself and needs no ROS on the box. With
haptic-crtk-bridge an arm that speaks CRTK, such as an MTM of a dVRK, is the
handle.")
set(CPACK_DEBIAN_ROS_PACKAGE_DEPENDS "hapticd (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_DEBIAN_ROS_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
