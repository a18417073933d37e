!> Contact sets: the beam with a given set of closed contacts, and its motion in closed form, a sum of terms exp(s t).
!> Closed rigid contacts are constraints, closed compliant contacts apply forces (docs/theory.md, section 17). If each
!> mode has its own damping ratio, rigid contacts apply forces, too (section 18). A set is made at first use and cached.
module contact_sets
   use compliant_stop, only: has_same_dynamic_stiffness, dynamic_stiffness_t, is_rigid_stop
   use constrained_sets, only: are_constraints, carriers_among, damp_constrained_set, free_beam_t, constrained_set_t, &
      has_mass_damping, make_constrained_set, find_static_state
   use coupled_modes, only: compare_sides, coupled_modes_t, make_coupled_modes, mirror_terms
   use damped_oscillators, only: sampler_t
   use failures, only: failure_t
   use forced_responses, only: unit_responses_t
   use free_modes, only: free_modes_t
   use kinds, only: i8, wp
   use modal_signal, only: modal_state_t
   use power_integrals, only: power_form_t, interval_terms_t
   use row_integrals, only: shared_rows_t
   use signal_integrals, only: squares_t
   implicit none (type, external)
   private
   public :: contact_set_t, set_store_t, start_sets, find_set, has_force_row

   !> The beam with one combination of closed contacts.
   type :: contact_set_t
      !> Number of the last run that used the set, as counted by the store
      integer :: run = 0
      !> Number of the last request for the set, as counted by the store
      integer(i8) :: request = 0_i8
      !> Which contacts are closed, [contacts]
      logical, allocatable :: is_closed(:)
      !> The beam with rigid contacts as constraints (if each mode has its own damping ratio, only contacts of one
      !> mode), which sets with other compliant contacts share
      type(constrained_set_t), pointer :: constrained => null()
      !> Indices of all other closed contacts, which apply forces
      integer, allocatable :: compliant(:)
      !> Terms exp(s t) of the motion with these contacts
      type(coupled_modes_t) :: coupled
      !> Gap of each contact in each term exp(s t) of amplitude 1, [contacts, terms]
      complex(wp), allocatable :: gap(:, :)
      !> Reaction of each constraint in each term exp(s t) of amplitude 1, [constraints, terms]
      complex(wp), allocatable :: reaction(:, :)
      !> Modal displacements in static equilibrium without loads, [modes]
      real(wp), allocatable :: rest_modes(:)
      !> Forces of the contacts in `compliant`, gaps of all contacts, and reactions of the constraints in static
      !> equilibrium, [compliant], [contacts], [constraints]
      real(wp), allocatable :: rest_force(:), rest_gap(:), rest_reaction(:)
      !> Generates equally spaced samples in phases without compliant contacts
      type(sampler_t) :: sampler
      !> Dissipated power of the beam; unallocated: not requested yet
      type(power_form_t), allocatable :: beam_loss
      !> Dissipated power of each compliant contact, [compliant]; unallocated: not used yet
      type(power_form_t), allocatable :: losses(:)
      !> Values of the terms at the start of the phase and at the last requested time
      type(interval_terms_t) :: span
      !> Responses of the set to unit loads; unallocated: no loads, or not used yet
      type(unit_responses_t), allocatable :: forced
      !> Integrals of products of the terms, for integrals of squared signals
      type(squares_t) :: squares
      !> Output rows (gaps, forces, tip) as sums of terms and load harmonics, which sets with the same stops on other
      !> sides use in common
      type(shared_rows_t), pointer :: shared => null()
      !> Whether the output rows have been made
      logical :: has_rows = .false.
      !> Whether the output rows suit the simultaneous search of all contacts
      logical :: can_search_rows = .false.
      !> Index of the row of each gap, [contacts]
      integer, allocatable :: gap_row(:)
      !> Index of the row of each force that no combination of gap and gap rate gives, [contacts]; 0: there is none
      integer, allocatable :: force_row(:)
      !> Contact from whose gap the coefficients of a row are taken, [rows]; contacts at one point share a row
      integer, allocatable :: row_contact(:)
      !> Gap divided by the value of its row, 1 or -1, [contacts]
      real(wp), allocatable :: gap_sign(:)
      !> Index of the row of the tip displacement, which may be that of a gap
      integer :: tip_row = 0
      !> Tip displacement divided by the value of its row, 1 or -1
      real(wp) :: tip_row_sign = 1.0_wp
      !> Number of terms besides load harmonics
      integer :: motion_terms = 0
      !> State of the modes at the start and end of a phase: displacements and rates of both, [modes, 4]
      real(wp), allocatable :: state(:, :)
      !> Homogeneous part of the state at the last instant evaluated, cached
      type(modal_state_t) :: last
   end type contact_set_t

   !> Maximum number of stored sets; four stops on both sides have 81 sets.
   integer, parameter :: max_sets = 1024
   !> Maximum size of the stored sets, bytes.
   real(wp), parameter :: max_bytes = 1.0e8_wp
   !> Maximum size of the stored sets of each other beam, bytes.
   real(wp), parameter :: max_other_bytes = 2.5e7_wp

   !> Element of an array of pointers to contact sets, with a number that depends on the closed contacts.
   type :: set_pointer_t
      type(contact_set_t), pointer :: set => null()
      integer(i8) :: key = 0_i8
   end type set_pointer_t

   !> Contact sets of one beam and its contacts.
   type :: beam_sets_t
      private
      type(free_beam_t) :: beam
      logical, allocatable :: is_rigid(:)
      type(dynamic_stiffness_t), allocatable :: spring(:)
      !> Unallocated: no set was made yet
      type(set_pointer_t), allocatable :: sets(:)
      integer :: count = 0
   end type beam_sets_t

   !> Contact sets of the present run, reused by later runs with the same beam, damping and stops. A full store drops
   !> its oldest sets.
   type, extends(beam_sets_t) :: set_store_t
      private
      !> Sets of other beams, the last used first: trial runs, and runs of a sweep, alternate among a few numbers of
      !> modes
      type(beam_sets_t), allocatable :: others(:)
      !> Maximum number of these other beams
      integer, public :: max_others = 8
      !> Number of runs so far
      integer :: run = 0
      !> Number of requests for sets so far
      integer(i8) :: request = 0_i8
      !> A set that must not be deallocated: stored signals point to its oscillators
      type(contact_set_t), pointer, public :: in_use => null()
      !> Common modes of a beam, and all its modes; unallocated: trials have not needed all modes yet
      type(free_modes_t), allocatable, public :: common_modes, all_modes
   contains
      final :: drop_all
   end type set_store_t

contains

   !> Start a run: sets of another beam, other signs or other springs are deallocated. If only stiffness-proportional
   !> damping changes, the modes of the constrained beam are reused.
   subroutine start_sets(beam, is_rigid, spring, store)
      type(free_beam_t), intent(in) :: beam
      !> Whether the stop of each contact is rigid, [contacts]
      logical, intent(in) :: is_rigid(:)
      !> Dynamic stiffnesses of compliant contacts, [contacts]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(set_store_t), intent(inout) :: store

      integer :: i

      if (store%run > 0 .and. .not. is_reusable(store, beam, is_rigid, spring)) then
         if (.not. allocated(store%others)) allocate (store%others(store%max_others))
         do i = 1, store%max_others
            if (is_reusable(store%others(i), beam, is_rigid, spring)) exit
         end do
         call exchange(store, i)
      end if
      if (.not. is_reusable(store, beam, is_rigid, spring)) then
         call drop_sets(store)
         store%is_rigid = is_rigid
         store%spring = spring
         store%beam = beam
      else if (.not. has_same_damping(store%beam, beam)) then
         if (has_mass_damping(store%beam) .or. has_mass_damping(beam)) then
            call drop_sets(store)
         else
            call drop_compliant(store)
         end if
         store%beam = beam
      else
         ! of the components of the beam that sets read, only the heights can differ
         store%beam%height(:) = beam%height
      end if
      store%run = store%run + 1
      store%in_use => null()
   end subroutine start_sets

   !> Move the sets of the present beam to `others`, and make those of another beam, or none, the present ones.
   subroutine exchange(store, place)
      type(set_store_t), intent(inout) :: store
      !> Index of the other beam in `others`; if it exceeds their number, no sets become present, and those of the last
      !> beam are deallocated
      integer, intent(in) :: place

      type(beam_sets_t) :: taken
      integer :: last

      last = min(place, size(store%others))
      if (place > last) call drop_sets(store%others(last))
      taken = store%others(last)
      store%others(2:last) = store%others(1:last - 1)
      store%others(1) = store%beam_sets_t
      if (bytes_in(store) > max_other_bytes) call drop_sets(store%others(1))
      store%beam_sets_t = taken
   end subroutine exchange

   !> Whether the sets of a store suit these contacts; heights of contacts and the damping of the beam are not compared.
   pure logical function is_reusable(store, beam, is_rigid, spring) result(answer)
      class(beam_sets_t), intent(in) :: store
      type(free_beam_t), intent(in) :: beam
      logical, intent(in) :: is_rigid(:)
      type(dynamic_stiffness_t), intent(in) :: spring(:)

      answer = .false.
      if (store%count == 0) return
      if (size(is_rigid) /= size(store%is_rigid) .or. size(beam%tip_value) /= size(store%beam%tip_value)) return
      answer = all(is_rigid .eqv. store%is_rigid) .and. all(has_same_dynamic_stiffness(spring, store%spring))
      if (.not. answer) return
      associate (old => store%beam)
         answer = all(is_equal(beam%oscillators%square, old%oscillators%square)) .and. &
            all(is_equal(beam%value, old%value)) .and. all(is_equal(beam%tip_value, old%tip_value)) .and. &
            all(is_equal(beam%tip_sign, old%tip_sign))
      end associate
   end function is_reusable

   !> Whether two beams with the same modes have the same damping.
   pure logical function has_same_damping(beam, old) result(answer)
      type(free_beam_t), intent(in) :: beam
      type(free_beam_t), intent(in) :: old

      answer = is_equal(beam%oscillators%two_zeta, old%oscillators%two_zeta) .and. &
         all(is_equal(beam%oscillators%mass_rate, old%oscillators%mass_rate)) .and. &
         (beam%has_modal_damping .eqv. old%has_modal_damping)
   end function has_same_damping

   !> Deallocate the sets with compliant contacts, because damping changes their terms.
   subroutine drop_compliant(store)
      type(set_store_t), intent(inout) :: store

      integer :: i, remaining

      remaining = 0
      do i = 1, store%count
         if (size(store%sets(i)%set%compliant) == 0) then
            remaining = remaining + 1
            store%sets(remaining) = store%sets(i)
         else
            call drop_set(store%sets(i)%set)
         end if
      end do
      store%count = remaining
   end subroutine drop_compliant

   !> Whether two values are exactly equal.
   elemental logical function is_equal(a, b) result(answer)
      real(wp), intent(in) :: a
      real(wp), intent(in) :: b

      answer = a <= b .and. a >= b
   end function is_equal

   !> Find the set of the given closed contacts, [contacts], or make it if the store has none.
   subroutine find_set(is_closed, store, set, is_new, error)
      logical, intent(in) :: is_closed(:)
      !> Prepared for the run by `start_sets`
      type(set_store_t), intent(inout) :: store
      type(contact_set_t), pointer, intent(out) :: set
      !> Whether the present run uses the set for the first time
      logical, intent(out) :: is_new
      !> Set if the exponents are not found
      type(failure_t), allocatable, intent(inout) :: error

      integer(i8) :: key
      integer :: i

      store%request = store%request + 1_i8
      key = 0_i8
      do i = 1, size(is_closed)
         if (is_closed(i)) key = ieor(key, shiftl(1_i8, modulo(i, storage_size(key))))
      end do
      do i = 1, store%count
         if (store%sets(i)%key /= key) cycle
         set => store%sets(i)%set
         if (.not. all(set%is_closed .eqv. is_closed)) cycle
         set%request = store%request
         is_new = set%run /= store%run
         if (is_new) then
            set%has_rows = .false.
            call update_constrained(store%beam, set%constrained)
            set%sampler = sampler_t()
            call find_equilibrium(set)
            set%run = store%run
         end if
         return
      end do
      is_new = .true.
      call make_room(store)
      if (.not. allocated(store%sets)) allocate (store%sets(max_sets))
      allocate (set)
      store%count = store%count + 1
      store%sets(store%count) = set_pointer_t(set, key)
      set%run = store%run
      set%request = store%request
      call make_set(store, is_closed, set, error)
      if (.not. allocated(error)) return
      ! later runs must not find a set without terms
      call drop_set(store%sets(store%count)%set)
      store%count = store%count - 1
   end subroutine find_set

   !> Give constrained modes the damping of the present beam and the heights of its contacts.
   subroutine update_constrained(beam, constrained)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(inout) :: constrained

      if (.not. is_equal(constrained%oscillators%two_zeta, beam%oscillators%two_zeta)) call damp_constrained_set(beam, &
         constrained)
      call find_static_state(beam, constrained)
   end subroutine update_constrained

   !> Deallocate the sets that were not requested for longest until a further set fits into the store.
   subroutine make_room(store)
      type(set_store_t), intent(inout) :: store

      real(wp) :: bytes
      integer :: i, oldest

      bytes = bytes_in(store)
      do while (store%count == max_sets .or. bytes > max_bytes)
         oldest = minloc([(store%sets(i)%set%request, i=1, store%count)], dim=1, &
            mask=[(.not. associated(store%sets(i)%set, store%in_use), i=1, store%count)])
         if (oldest == 0) return
         bytes = bytes - bytes_of(store%sets(oldest)%set)
         call drop_set(store%sets(oldest)%set)
         store%sets(oldest:store%count - 1) = store%sets(oldest + 1:store%count)
         store%count = store%count - 1
      end do
   end subroutine make_room

   !> Memory of the large arrays of all sets of the present beam, in bytes.
   pure real(wp) function bytes_in(store) result(bytes)
      class(beam_sets_t), intent(in) :: store

      integer :: i

      bytes = sum([(bytes_of(store%sets(i)%set), i=1, store%count)])
   end function bytes_in

   !> Memory of the large arrays of a set, in bytes; the factors count these arrays.
   pure real(wp) function bytes_of(set) result(bytes)
      type(contact_set_t), intent(in) :: set

      real(wp), parameter :: word = 8.0_wp

      bytes = word*real(set%constrained%count, wp)*(real(3*set%constrained%count + 12*size(set%is_closed), wp) &
         + 4.0_wp*real(set%coupled%count, wp))
      if (allocated(set%shared%form)) bytes = bytes + 2.0_wp*word*real(size(set%shared%form%half), wp) &
         /real(set%shared%users, wp)
      if (allocated(set%squares%matrix)) bytes = bytes + 2.0_wp*word*real(size(set%squares%matrix), wp)
      if (allocated(set%losses)) bytes = bytes + 8.0_wp*word*real(1 + size(set%losses), wp) &
         *real(set%coupled%count, wp)**2
   end function bytes_of

   !> Deallocate all sets.
   subroutine drop_all(store)
      type(set_store_t), intent(inout) :: store

      integer :: i

      call drop_sets(store)
      if (.not. allocated(store%others)) return
      do i = 1, size(store%others)
         call drop_sets(store%others(i))
      end do
   end subroutine drop_all

   !> Deallocate the sets of one beam.
   subroutine drop_sets(store)
      class(beam_sets_t), intent(inout) :: store

      integer :: i

      do i = 1, store%count
         call drop_set(store%sets(i)%set)
      end do
      store%count = 0
   end subroutine drop_sets

   !> Deallocate a set, and its parts that no other set shares.
   subroutine drop_set(set)
      type(contact_set_t), pointer, intent(inout) :: set

      set%constrained%users = set%constrained%users - 1
      if (set%constrained%users == 0) deallocate (set%constrained)
      set%shared%users = set%shared%users - 1
      if (set%shared%users == 0) then
         deallocate (set%shared)
         if (associated(set%coupled%weight_parts)) deallocate (set%coupled%weight_parts, set%coupled%shape_parts)
      end if
      deallocate (set)
   end subroutine drop_set

   !> Make the set of a combination of closed contacts.
   subroutine make_set(store, is_closed, set, error)
      !> The set is the last one
      class(beam_sets_t), intent(in) :: store
      logical, intent(in) :: is_closed(:)
      type(contact_set_t), target, intent(inout) :: set
      type(failure_t), allocatable, intent(inout) :: error

      real(wp), allocatable :: sign(:)
      integer, allocatable :: carriers(:), closed(:), place(:)
      integer :: i, m
      logical :: is_constrained(size(is_closed))

      allocate (set%is_closed, source=is_closed)
      is_constrained = is_closed .and. store%is_rigid .and. are_constraints(store%beam)
      closed = pack([(i, i=1, size(is_closed))], is_constrained)
      allocate (set%compliant, source=pack([(i, i=1, size(is_closed))], is_closed .and. .not. is_constrained))
      carriers = carriers_among(store%beam, set%compliant)
      do i = 1, store%count - 1
         associate (old => store%sets(i)%set%constrained)
            if (size(old%closed) /= size(closed) .or. size(old%carriers) /= size(carriers)) cycle
            if (all([old%closed == closed, old%carriers == carriers])) set%constrained => store%sets(i)%set%constrained
            if (associated(set%constrained)) exit
         end associate
      end do
      if (associated(set%constrained)) then
         call update_constrained(store%beam, set%constrained)
      else
         allocate (set%constrained)
         call make_constrained_set(store%beam, closed, set%constrained, carriers)
      end if
      set%constrained%users = set%constrained%users + 1
      allocate (set%state(set%constrained%count, 4), set%last%z(set%constrained%count), &
         set%last%v(set%constrained%count), place(size(set%compliant)), sign(size(set%compliant)))
      do i = 1, store%count - 1
         if (size(place) == 0) exit
         associate (other => store%sets(i)%set)
            if (size(other%compliant) /= size(place) .or. .not. associated(other%constrained, set%constrained) &
               .or. .not. allocated(other%gap)) cycle
            call compare_sides(store%spring(set%compliant), set%constrained%value(:, set%compliant), &
               store%spring(other%compliant), other%constrained%value(:, other%compliant), place, sign)
            if (any(place == 0)) cycle
            call mirror_terms(other%coupled, place, sign, set%coupled)
            set%gap = other%gap
            set%gap(set%compliant, :) = -set%coupled%indentation
            set%reaction = other%reaction
            call share_rows(store%spring(set%compliant), other, set)
            exit
         end associate
      end do
      if (.not. associated(set%shared)) allocate (set%shared)
      set%shared%users = set%shared%users + 1
      if (size(place) == 0) return
      if (.not. allocated(set%gap)) then
         call make_coupled_modes(set%constrained%oscillators, set%constrained%value(:, set%compliant), &
            store%spring(set%compliant), set%coupled, error)
         if (allocated(error)) return
         associate (constrained => set%constrained, coupled => set%coupled, n => set%coupled%count)
            allocate (set%gap(size(is_closed), n), set%reaction(size(constrained%closed), n))
            set%gap(:, :) = cmplx(matmul(transpose(constrained%value), real(coupled%shape, wp)), &
               matmul(transpose(constrained%value), aimag(coupled%shape)), wp)
            set%gap(set%compliant, :) = -coupled%indentation
            set%gap(constrained%closed, :) = 0.0_wp
            do m = 1, merge(n, 0, size(closed) > 0)
               set%reaction(:, m) = matmul(constrained%reaction, coupled%shape(:, m))*coupled%viscous(m) &
                  - matmul(constrained%balanced_fraction(:, set%compliant), coupled%force(:, m))
            end do
         end associate
      end if
      call find_equilibrium(set)
   end subroutine make_set

   !> Let a set share the output rows of a set with the same stops on other sides, unless forces are among the rows: a
   !> force changes its sign with the side.
   subroutine share_rows(spring, other, set)
      !> Dynamic stiffnesses of the closed compliant contacts
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(contact_set_t), intent(in) :: other
      !> Set whose terms point to the terms of the other set
      type(contact_set_t), intent(inout) :: set

      if (size(set%constrained%closed) == 0 .and. .not. any(has_force_row(spring))) then
         set%shared => other%shared
      else
         allocate (set%coupled%weight_parts, source=other%coupled%weight_parts)
         allocate (set%coupled%shape_parts, source=other%coupled%shape_parts)
      end if
   end subroutine share_rows

   !> Whether the force of a closed compliant contact is no combination of its gap and gap rate, as that of a spring and
   !> damper is.
   elemental logical function has_force_row(spring) result(answer)
      type(dynamic_stiffness_t), intent(in) :: spring

      answer = spring%branch_stiffness > 0.0_wp .or. is_rigid_stop(spring)
   end function has_force_row

   !> Static equilibrium on compliant contacts, relative to that of the constrained beam.
   pure subroutine find_equilibrium(set)
      type(contact_set_t), intent(inout) :: set

      if (size(set%compliant) == 0) return
      associate (constrained => set%constrained, coupled => set%coupled)
         ! heights above the static state of the constrained beam
         associate (heights => -constrained%static_gap(set%compliant))
            set%rest_force = matmul(coupled%static_force, heights)
            set%rest_modes = matmul(coupled%static_shape, heights)
         end associate
         set%rest_gap = constrained%static_gap + matmul(set%rest_modes, constrained%value)
         set%rest_reaction = constrained%static_force + matmul(constrained%reaction, set%rest_modes) &
            - matmul(constrained%balanced_fraction(:, set%compliant), set%rest_force)
      end associate
   end subroutine find_equilibrium

end module contact_sets
