# A physics server as a library of its own, and the tests that open it; see pybullet_stub.h.
add_library(pybullet_stub MODULE pybullet_stub.cpp)
target_link_libraries(pybullet_stub PRIVATE carom::audio PkgConfig::carom_bullet_dependency)
target_include_directories(pybullet_stub PRIVATE ${PROJECT_SOURCE_DIR})
carom_compile_options(pybullet_stub)

carom_test(pybullet_tests
  SOURCES
    contact_listener_test.cpp
    pybullet_command_test.cpp
    pybullet_description_test.cpp
    pybullet_plugin_test.cpp
    ../support/onset_detector.cpp
  LIBRARIES carom_pybullet_core GTest::gmock PkgConfig::carom_sndfile ${CMAKE_DL_LIBS})
target_compile_definitions(pybullet_tests PRIVATE
  CAROM_PYBULLET_PLUGIN="$<TARGET_FILE:carom_pybullet>"
  CAROM_PYBULLET_STUB="$<TARGET_FILE:pybullet_stub>"
  CAROM_NM="${CMAKE_NM}")
add_dependencies(pybullet_tests carom_pybullet pybullet_stub)

# Not part of the tests: what it costs.
add_executable(pybullet_cost EXCLUDE_FROM_ALL pybullet_cost.cpp)
target_link_libraries(pybullet_cost PRIVATE carom::audio ${CMAKE_DL_LIBS})
target_compile_definitions(pybullet_cost PRIVATE
  CAROM_PYBULLET_PLUGIN="$<TARGET_FILE:carom_pybullet>"
  CAROM_PYBULLET_STUB="$<TARGET_FILE:pybullet_stub>")
carom_compile_options(pybullet_cost)
add_dependencies(pybullet_cost carom_pybullet pybullet_stub)
