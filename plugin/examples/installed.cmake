# Builds the examples against an installed Carom. Where it is not in /usr, CMake is told:
#     cmake -S examples -B build -DCMAKE_PREFIX_PATH=/opt/carom && cmake --build build
cmake_minimum_required(VERSION 3.25)
project(carom_examples LANGUAGES C CXX)
find_package(carom 0.1 CONFIG REQUIRED COMPONENTS plugin bullet OPTIONAL_COMPONENTS shared)

file(GLOB examples ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/*/*.cpp)
foreach(source IN LISTS examples)
  cmake_path(GET source STEM example)
  add_executable(${example} ${source})
  target_link_libraries(${example} PRIVATE carom::plugin carom::bullet)  # the latter for Bullet's own headers and libraries
endforeach()

# In C, with libcarom.so alone.
if(TARGET carom::shared)
  foreach(example c_click c_host)
    add_executable(${example} ${example}.c)
    target_link_libraries(${example} PRIVATE carom::shared m)
  endforeach()
endif()
