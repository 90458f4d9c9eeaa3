# Where the test framework comes from. Gives the target `unity` and the function pdcp_cmock_test.
#
# Unity is looked for in this order: UNITY_ROOT (variable or environment), the standard prefixes, build/unity (which
# tools/setup makes), and, when asked with -DPDCP_FETCH=ON, upstream. CMock likewise: CMOCK_ROOT, the standard
# prefixes, upstream; it needs Ruby.
option(PDCP_FETCH "Fetch Unity and CMock from upstream where they are not installed" OFF)
set(PDCP_UNITY_COMMIT "cbcd08fa7de711053a3deec6339ee89cad5d2697" CACHE STRING "Commit of upstream Unity for PDCP_FETCH: the full hash of v2.6.1")
set(PDCP_CMOCK_COMMIT "49435d9f3313abb3422252d3d2dc12a7542332ca" CACHE STRING "Commit of upstream CMock for PDCP_FETCH: the full hash of v2.6.0")

# pdcp_fetch(NAME COMMIT RESULT): sources of ThrowTheSwitch/NAME at COMMIT, their folder in the variable RESULT. A tag
# can be moved and is refused; git itself proves a full hash.
function(pdcp_fetch name commit result)
    string(TOUPPER ${name} upper_name)
    string(LENGTH "${commit}" length)
    if(NOT commit MATCHES "^[0-9a-f]+$" OR NOT length EQUAL 40)
        message(FATAL_ERROR "PDCP_FETCH wants ${name}'s full commit hash: add -DPDCP_${upper_name}_COMMIT=HASH")
    endif()
    include(FetchContent)
    # A folder without a CMakeLists.txt as SOURCE_SUBDIR: fetched, not configured.
    FetchContent_Declare(${name}
        GIT_REPOSITORY https://github.com/ThrowTheSwitch/${name}.git
        GIT_TAG ${commit}
        SOURCE_SUBDIR src)
    FetchContent_MakeAvailable(${name})
    FetchContent_GetProperties(${name} SOURCE_DIR source_dir)
    set(${result} ${source_dir} PARENT_SCOPE)
endfunction()

# unity_internals.h and not unity.h: a desktop library has a header of the latter name.
set(unity_places ${UNITY_ROOT} $ENV{UNITY_ROOT} ${CMAKE_SOURCE_DIR}/build/unity)
find_path(UNITY_INCLUDE_DIR unity_internals.h HINTS ${unity_places} PATH_SUFFIXES src unity include/unity)
if(NOT UNITY_INCLUDE_DIR AND PDCP_FETCH)
    pdcp_fetch(Unity "${PDCP_UNITY_COMMIT}" unity_source)
    set(UNITY_INCLUDE_DIR ${unity_source}/src CACHE PATH "Folder of Unity's headers" FORCE)
endif()
if(NOT UNITY_INCLUDE_DIR)
    message(FATAL_ERROR "Unity was not found: run tools/setup, or set UNITY_ROOT, or configure with -DPDCP_FETCH=ON")
endif()

# Built here, without our warning flags, where its source is at hand: then sanitizers see it too.
if(EXISTS ${UNITY_INCLUDE_DIR}/unity.c)
    add_library(unity STATIC ${UNITY_INCLUDE_DIR}/unity.c)
else()
    find_library(UNITY_LIBRARY NAMES libunity.a HINTS ${unity_places} PATH_SUFFIXES lib REQUIRED)
    add_library(unity STATIC IMPORTED GLOBAL)
    set_target_properties(unity PROPERTIES IMPORTED_LOCATION ${UNITY_LIBRARY})
endif()
target_include_directories(unity SYSTEM INTERFACE ${UNITY_INCLUDE_DIR})

find_program(RUBY_PROGRAM ruby)
find_path(CMOCK_SCRIPT_DIR cmock.rb HINTS ${CMOCK_ROOT} $ENV{CMOCK_ROOT} PATH_SUFFIXES lib share/cmock/lib cmock/lib)
if(NOT CMOCK_SCRIPT_DIR AND RUBY_PROGRAM AND PDCP_FETCH)
    pdcp_fetch(CMock "${PDCP_CMOCK_COMMIT}" cmock_source)
    set(CMOCK_SCRIPT_DIR ${cmock_source}/lib CACHE PATH "Folder of cmock.rb" FORCE)
endif()

# pdcp_cmock_test(NAME MOCKS HEADER... LIBRARIES LIBRARY...): NAME.c is one program with a mock of every HEADER, and
# the ctest test unit.NAME. Without Ruby and CMock that test is skipped, and its name still stands in the results.
function(pdcp_cmock_test name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "MOCKS;LIBRARIES")
    if(NOT RUBY_PROGRAM OR NOT CMOCK_SCRIPT_DIR)
        add_test(NAME unit.${name} COMMAND ${CMAKE_COMMAND} -E echo "skipped: Ruby or CMock was not found")
        set_tests_properties(unit.${name} PROPERTIES LABELS unit SKIP_REGULAR_EXPRESSION "^skipped: ")
        return()
    endif()
    set(mock_dir ${CMAKE_CURRENT_BINARY_DIR}/${name}.mocks)
    set(mock_sources)
    foreach(header IN LISTS arg_MOCKS)
        cmake_path(ABSOLUTE_PATH header)
        cmake_path(GET header STEM stem)
        add_custom_command(OUTPUT ${mock_dir}/mock_${stem}.c
            COMMAND ${RUBY_PROGRAM} ${CMOCK_SCRIPT_DIR}/cmock.rb --mock_path=${mock_dir} ${header}
            DEPENDS ${header} VERBATIM)
        list(APPEND mock_sources ${mock_dir}/mock_${stem}.c)
    endforeach()
    add_executable(${name} ${name}.c ${mock_sources} ${CMOCK_SCRIPT_DIR}/../src/cmock.c)
    target_include_directories(${name} PRIVATE ${mock_dir})
    target_include_directories(${name} SYSTEM PRIVATE ${CMOCK_SCRIPT_DIR}/../src)
    target_link_libraries(${name} PRIVATE unity ${arg_LIBRARIES})
    add_test(NAME unit.${name} COMMAND ${name})
    set_tests_properties(unit.${name} PROPERTIES LABELS unit TIMEOUT 60)
endfunction()
