# The port builds the sources that it lies in: vcpkg install carom --overlay-ports=FOLDER_OF_CAROM/packaging/vcpkg.
# In a registry, vcpkg_from_git() takes the place of these two lines.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
message(STATUS "Carom: building ${SOURCE_PATH}")

vcpkg_check_linkage(ONLY_STATIC_LIBRARY)
vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES modal CAROM_MODAL)
vcpkg_find_acquire_program(PKGCONFIG)

# vcpkg's MUMPS is a library of another name, with MPI or without; without it, modes of solids are computed ten times as slowly.
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    ${features}
    "-DPKG_CONFIG_EXECUTABLE=${PKGCONFIG}"
    -DCAROM_INSTALL=ON
    -DCAROM_LISTEN=OFF
    -DCAROM_MUMPS=OFF
    -DCAROM_PYBULLET_PLUGIN=OFF
    -DCAROM_SCENES=OFF
    -DCAROM_SHARED_C_API=OFF
    -DCAROM_TESTS=OFF
    -DCMAKE_UNITY_BUILD=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/carom)
vcpkg_fixup_pkgconfig()

file(REMOVE_RECURSE
  "${CURRENT_PACKAGES_DIR}/debug/include"
  "${CURRENT_PACKAGES_DIR}/debug/share"
  "${CURRENT_PACKAGES_DIR}/share/doc")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
