!> Periodic motions under periodic loads, and branches of them over a parameter (docs/theory.md, section 22).
module orbit_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: orbit_point_t, orbit_branch_t, orbit_study_t
   public :: mark_none, mark_fold, mark_doubling, mark_torus, mark_grazing, mark_limit, mark_lost, mark_names

   !> What is special about a point of a branch: nothing; it turns back (a multiplier of 1); its period doubles (-1); a
   !> torus leaves it (a pair of modulus 1); an impact comes or goes; the range ends; Newton's method fails beyond.
   integer, parameter :: mark_none = 0
   integer, parameter :: mark_fold = 1
   integer, parameter :: mark_doubling = 2
   integer, parameter :: mark_torus = 3
   integer, parameter :: mark_grazing = 4
   integer, parameter :: mark_limit = 5
   integer, parameter :: mark_lost = 6
   character(*), parameter :: mark_names(0:6) = [character(20) :: 'regular', 'fold', 'period_doubling', &
      'neimark_sacker', 'grazing', 'end_of_range', 'lost']

   !> A motion that returns to where it was.
   type :: orbit_point_t
      !> Amplitude or frequency of the load
      real(wp) :: value = 0.0_wp
      !> Periods of the load after which it returns, and the length of one
      integer :: periods = 1
      real(wp) :: period = 0.0_wp
      !> How far from its start it ends, in units of its size, and steps of Newton's method that it took
      real(wp) :: residual = huge(1.0_wp)
      integer :: iterations = 0
      !> On all surfaces, over all its periods
      integer :: impacts = 0
      !> Least speed of an impact with restitution; huge: there is none
      real(wp) :: least_speed = huge(1.0_wp)
      !> Floquet multipliers, the greatest first
      complex(wp), allocatable :: multiplier(:)
      !> Displacement of the tip, up from the unstressed beam, and its velocity at sections of phase 0, [2, periods]
      real(wp), allocatable :: tip(:, :)
      !> One of the `mark_` constants
      integer :: mark = mark_none
   contains
      procedure :: is_stable
   end type orbit_point_t

   type :: orbit_branch_t
      !> The branch and its point from which this one leaves; 0: from the orbit itself
      integer :: parent = 0
      integer :: parent_point = 0
      type(orbit_point_t), allocatable :: point(:)
   end type orbit_branch_t

   type :: orbit_study_t
      type(orbit_point_t) :: orbit
      !> The motion through it, from phase 0: instants, displacement and velocity of the tip, [samples], and of the beam
      !> at each surface, [surfaces, samples]
      real(wp), allocatable :: tau(:), tip(:), tip_velocity(:), stop(:, :), stop_velocity(:, :)
      !> Unallocated: no parameter was to vary
      type(orbit_branch_t), allocatable :: branch(:)
      !> What varies along branches, as in `quantity_table`
      character(16) :: quantity = 'frequency'
   end type orbit_study_t

contains

   !> Do motions that begin beside it come to it?
   elemental function is_stable(point) result(answer)
      class(orbit_point_t), intent(in) :: point
      logical :: answer

      answer = .false.
      if (allocated(point%multiplier)) answer = maxval(abs(point%multiplier)) < 1.0_wp
   end function is_stable

end module orbit_types
