!> The state of a motion at an instant, and its sections: what &poincare keeps of it once a period of the load
!> (docs/theory.md, section 21).
module section_types
   use kinds, only: wp
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: section_state_t, run_sections_t

   !> All that decides how a motion goes on. Surfaces in the order of `contacts_of`.
   type :: section_state_t
      !> When it was so
      real(wp) :: tau = 0.0_wp
      !> Displacements and velocities of the free modes (newmark: of the degrees of freedom, [-2 : order + 3]);
      !> unallocated: no state
      real(wp), allocatable :: q(:), v(:)
      !> These are so many of the lowest modes, and residual modes; 0: they are all modes
      integer :: lowest_modes = 0
      !> The surface is under force; open, but not yet home
      logical, allocatable :: is_closed(:), is_deformed(:)
      !> Its indentation u, and the force in its branch
      real(wp), allocatable :: depth(:), branch_force(:)
      !> The flight under way is a capture if it stays below this, as it did so far (newmark: what it has reached)
      real(wp), allocatable :: hop_tolerance(:)
      logical, allocatable :: is_low(:)
      !> Variations of the state: what goes on from them tells those that they become; unallocated: not asked for
      type(tangent_t), allocatable :: tangent
   end type section_state_t

   type :: run_sections_t
      !> Of the load, tau
      real(wp) :: period = 0.0_wp
      !> Longest period of the motion that is looked for, and how near a state must return
      integer :: most_periods = 1
      real(wp) :: tolerance = 0.0_wp
      !> Instants, [sections]; the first `count` have come
      real(wp), allocatable :: tau(:)
      integer :: count = 0
      !> Displacement, up from the unstressed beam, and velocity of the tip, [2, sections], and at each surface in the
      !> scene's order, [2, surfaces, sections]
      real(wp), allocatable :: tip(:, :), stop(:, :, :)
      !> The same of the free modes, [2, modes, sections]; unallocated: not asked for
      real(wp), allocatable :: modes(:, :, :)
      !> Since the section before, [sections]
      integer, allocatable :: impacts(:)
      !> Logarithm of the size of a variation at each section, no number where nothing is left of it;
      !> unallocated: it is not followed
      real(wp), allocatable :: log_size(:)
      !> How fast that grows, per tau
      real(wp) :: lyapunov_exponent = 0.0_wp
      !> Of the motion, in those of the load; 0: none was found
      integer :: motion_period = 0
      real(wp) :: impacts_per_period = 0.0_wp
      !> Surface, in the scene's order, of the stop from which the beam is released; 0: there is none
      integer :: release_contact = 0
   end type run_sections_t

end module section_types
