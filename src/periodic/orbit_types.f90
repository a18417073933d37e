!> Periodic orbits under periodic loads, and branches of orbits over a parameter (docs/theory.md, section 22). An orbit
!> is a motion that returns to its initial state after one or more periods of the load. The phase of an instant is here
!> the elapsed fraction of the load period, 0 to 1; a section is the state of the motion once in each load period, at a
!> fixed phase.
module orbit_types
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: orbit_point_t, orbit_branch_t, orbit_study_t
   public :: mark_none, mark_fold, mark_doubling, mark_torus, mark_grazing, mark_limit, mark_lost, mark_names, &
      mark_words

   ! The following constants are kinds of points of a branch.
   !> Regular point.
   integer, parameter :: mark_none = 0
   !> Fold: a Floquet multiplier is 1.
   integer, parameter :: mark_fold = 1
   !> Period doubling: a Floquet multiplier is -1.
   integer, parameter :: mark_doubling = 2
   !> Neimark-Sacker bifurcation, at which a torus arises: a complex pair of multipliers has modulus 1.
   integer, parameter :: mark_torus = 3
   !> Grazing point, at which an impact appears or vanishes.
   integer, parameter :: mark_grazing = 4
   !> End of the range of the parameter.
   integer, parameter :: mark_limit = 5
   !> Point after which Newton's method fails.
   integer, parameter :: mark_lost = 6
   !> Names of these kinds in results files.
   character(*), parameter :: mark_names(0:6) = [character(15) :: 'regular', 'fold', 'period_doubling', &
      'neimark_sacker', 'grazing', 'end_of_range', 'lost']
   !> The same on a terminal.
   character(*), parameter :: mark_words(0:6) = [character(15) :: 'regular', 'fold', 'period doubling', 'torus', &
      'grazing', 'end of range', 'lost']

   !> A periodic orbit.
   type :: orbit_point_t
      !> Parameter: amplitude or frequency of the load
      real(wp) :: value = 0.0_wp
      !> Period of the orbit in periods of the load
      integer :: periods = 1
      !> Length of one load period, tau
      real(wp) :: period = 0.0_wp
      !> Distance between end and start of the orbit relative to its size
      real(wp) :: residual = huge(1.0_wp)
      !> Number of Newton steps
      integer :: iterations = 0
      !> Number of impacts at all contacts, over all periods of the orbit
      integer :: impacts = 0
      !> Minimum normal speed of an impact with restitution; huge: there is none
      real(wp) :: min_speed = huge(1.0_wp)
      !> Floquet multipliers, in descending order of magnitude
      complex(wp), allocatable :: multiplier(:)
      !> Displacement of the tip, upward from the undeformed beam, and its velocity, at sections of phase 0, [2,
      !> periods]
      real(wp), allocatable :: tip(:, :)
      !> Kind of the point, one of the `mark_` constants
      integer :: mark = mark_none
   contains
      procedure :: is_stable
   end type orbit_point_t

   !> A branch: orbits in the order of the continuation, with their bifurcations.
   type :: orbit_branch_t
      !> Index of the parent branch, from which this branch leaves; 0: this branch contains the orbit of the study
      integer :: parent = 0
      !> Index of the point of the parent branch at which this branch leaves
      integer :: parent_point = 0
      type(orbit_point_t), allocatable :: point(:)
   end type orbit_branch_t

   !> Result: the orbit that the run approaches, and its branches.
   type :: orbit_study_t
      type(orbit_point_t) :: orbit
      !> Instants of the histories over one period of the orbit, from phase 0, [samples]
      real(wp), allocatable :: tau(:)
      !> Displacement of the tip, [samples]
      real(wp), allocatable :: tip(:)
      !> Velocity of the tip, [samples]
      real(wp), allocatable :: tip_velocity(:)
      !> Displacement of the beam at each contact, [contacts, samples]
      real(wp), allocatable :: stop(:, :)
      !> Velocity of the beam at each contact, [contacts, samples]
      real(wp), allocatable :: stop_velocity(:, :)
      !> Branches; unallocated: no parameter varies
      type(orbit_branch_t), allocatable :: branch(:)
      !> Quantity that varies along branches, as in `quantity_table`
      character(16) :: quantity = 'frequency'
   end type orbit_study_t

contains

   !> Whether the orbit is asymptotically stable.
   elemental logical function is_stable(point) result(answer)
      class(orbit_point_t), intent(in) :: point

      answer = .false.
      if (allocated(point%multiplier)) answer = maxval(abs(point%multiplier)) < 1.0_wp
   end function is_stable

end module orbit_types
