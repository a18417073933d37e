!> The programs of the project, each of which takes the groups of scene files that concern it.
module programs
   implicit none (type, external)
   private
   public :: program_motion, program_paper, program_benchmark, program_any, name_of_program, program_called

   !> Runs, frequencies, sweeps, cases; the statements of the paper; run time against error. A sum of them is several.
   integer, parameter :: program_motion = 1
   integer, parameter :: program_paper = 2
   integer, parameter :: program_benchmark = 4
   integer, parameter :: program_any = program_motion + program_paper + program_benchmark

   integer, parameter :: all(3) = [program_motion, program_paper, program_benchmark]
   character(*), parameter :: names(3) = [character(20) :: 'impactbeam', 'impactbeam-paper', 'impactbeam-benchmark']

contains

   !> What the user types for it; of several, the first.
   pure function name_of_program(program) result(name)
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program
      character(:), allocatable :: name

      name = trim(names(findloc(iand(all, program) > 0, .true., 1)))
   end function name_of_program

   !> Its constant; of a name that is none, that of all.
   pure function program_called(name) result(program)
      character(*), intent(in) :: name
      integer :: program

      program = program_any
      if (any(names == name)) program = all(findloc(names == name, .true., 1))
   end function program_called

end module programs
