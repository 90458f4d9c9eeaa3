# What the toolchain files have in common. PDCP_PART (a preset sets it) is the part, as the compiler's -mcpu wants it.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR dsPIC33)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PDCP_PART XC16_ROOT XC_DSC_ROOT XC_DSC_DFP)

if(NOT PDCP_PART)
    message(FATAL_ERROR "PDCP_PART is not set: configure with --preset dspic33fj64mc802 or dspic33ep512mu810")
endif()

file(GLOB PDCP_COMPILER_VERSIONS ${PDCP_COMPILER_GLOB})
list(SORT PDCP_COMPILER_VERSIONS COMPARE NATURAL ORDER DESCENDING)
foreach(tool gcc ar ranlib bin2hex)
    string(TOUPPER ${tool} variable)
    find_program(PDCP_${variable} ${PDCP_COMPILER_NAME}-${tool}
        HINTS ${PDCP_COMPILER_PLACES} ${PDCP_COMPILER_VERSIONS} PATH_SUFFIXES bin NO_CMAKE_FIND_ROOT_PATH)
    if(NOT PDCP_${variable} AND NOT tool STREQUAL ranlib)
        message(FATAL_ERROR
            "${PDCP_COMPILER_NAME}-${tool} was not found: install Microchip's ${PDCP_COMPILER_NAME}, or say where it is with ${PDCP_COMPILER_ROOT}; each of XC16 and XC-DSC has presets of its own")
    endif()
endforeach()

set(CMAKE_C_COMPILER ${PDCP_GCC})
set(CMAKE_AR ${PDCP_AR} CACHE FILEPATH "")
if(PDCP_RANLIB)
    set(CMAKE_RANLIB ${PDCP_RANLIB} CACHE FILEPATH "")
endif()
# GCC 4.5 with options of its own: what CMake finds out by compiling is said here.
set(CMAKE_C_COMPILER_ID GNU)
set(CMAKE_C_COMPILER_ID_RUN TRUE)
set(CMAKE_C_COMPILER_VERSION 4.5.1)
set(CMAKE_C_COMPILER_FORCED TRUE)
# The application is one struct larger than near memory (8 KB): structs and arrays are far, single variables near.
set(CMAKE_C_FLAGS_INIT "-mcpu=${PDCP_PART} -omf=elf -mlarge-data -msmall-scalar -ffunction-sections -fdata-sections")
if(XC_DSC_DFP)
    string(APPEND CMAKE_C_FLAGS_INIT " -mdfp=${XC_DSC_DFP}")
endif()
# -O1 is what every licence has. With -Os the compiler does no inlining at all unless it is asked for by name; functions
# that are called once cost least where they are called. What a pointer to an element saves, forwprop would undo.
set(CMAKE_C_FLAGS_RELEASE "-O1" CACHE STRING "")
set(CMAKE_C_FLAGS_MINSIZEREL "-Os -finline -finline-functions-called-once -fno-caller-saves -fno-tree-forwprop -fno-if-conversion" CACHE STRING "")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
