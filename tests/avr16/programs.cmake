# The test programs for the ATmega1284P: avr16_program(NAME PARTS SOURCE) for every unit test of the portable folders.
#
# Constants and texts are in RAM there. A program with too many is built in parts, which run some of its tests each
# (target/prelude.h).
set(avr16_parts_test_acceptance 1)
set(avr16_parts_test_arb_app 6)
set(avr16_parts_test_arb_hostapi 13)
set(avr16_parts_test_arb_hostbulk 4)
set(avr16_parts_test_arb_hostevents 4)
set(avr16_parts_test_arb_hostext 27)
set(avr16_parts_test_arb_hostlinks 6)
set(avr16_parts_test_arb_hostpass 8)
set(avr16_parts_test_pdcp_device_bind 2)
set(avr16_parts_test_pdcp_device_data 3)
set(avr16_parts_test_pdcp_exhaustive 4)
set(avr16_parts_test_pdcp_link 3)
set(avr16_parts_test_pdcp_setup 3)
set(avr16_parts_test_pdcp_standby 4)
set(avr16_parts_test_profile_acceptance 3)
set(avr16_parts_test_profile_candidates 4)
set(avr16_parts_test_profile_links 4)
set(avr16_parts_test_profile_originals 4)
set(avr16_parts_test_whole_app 1)
set(avr16_parts_default 2)

file(GLOB sources CONFIGURE_DEPENDS
    ${CMAKE_CURRENT_LIST_DIR}/../unit/test_arb_*.c
    ${CMAKE_CURRENT_LIST_DIR}/../unit/test_pdcp_*.c
    ${CMAKE_CURRENT_LIST_DIR}/../unit/test_profile_*.c
    ${CMAKE_CURRENT_LIST_DIR}/target/test_*.c)
# Tables of 128 channels twice are more than its RAM.
list(FILTER sources EXCLUDE REGEX "test_profile_slices\\.c$")
# Checks of headers are built for a PC only.
list(FILTER sources EXCLUDE REGEX "test_pdcp_assert\\.c$")
foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source NORMALIZE)
    cmake_path(GET source STEM name)
    set(parts ${avr16_parts_default})
    if(DEFINED avr16_parts_${name})
        set(parts ${avr16_parts_${name}})
    endif()
    avr16_program(${name} ${parts} ${source})
endforeach()
