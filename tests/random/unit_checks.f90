!> A scene in ratios written again in units: whatever these are, the motion is the same but for rounding, which it amplifies,
!> and so is all that is told of it.
module unit_checks
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use analyses, only: analysed_t
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use frequency_types, only: frequency_table_t
   use kinds, only: wp
   use load_settings, only: start_release
   use measure_list, only: first_statistic, measure_count, measure_table
   use number_text, only: to_text
   use random_numbers, only: next_random, random_t, start_random
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: method_exact, response_settings_t
   use random_checks, only: settle
   use scene_draft, only: draft_t, drop, has_name, put, value_of
   use scene_drawing, only: give_units
   use scene_types, only: scene_t
   use single_study, only: compute_scene
   implicit none (type, external)
   private
   public :: compare_units, unit_tally_t

   !> What was seen on the way.
   type :: unit_tally_t
      !> Scenes that were compared, with all of their events, and events
      integer :: scenes = 0
      integer :: whole = 0
      integer :: events = 0
   end type unit_tally_t

   !> Names with the dimension of a length, and powers of it
   type :: length_name_t
      character(8) :: group
      character(16) :: name
      integer :: power
   end type length_name_t

   type(length_name_t), parameter :: length_names(*) = [ &
      length_name_t('beam', 'length', 1), length_name_t('beam', 'width', 1), length_name_t('beam', 'height_root', 1), &
      length_name_t('beam', 'height_tip', 1), length_name_t('beam', 'station', 1), length_name_t('beam', 'height', 1), &
      length_name_t('beam', 'area', 2), length_name_t('beam', 'inertia', 4), length_name_t('section', 'station', 1), &
      length_name_t('section', 'width', 1), length_name_t('section', 'height', 1), length_name_t('section', 'diameter', 1), &
      length_name_t('section', 'outer_diameter', 1), length_name_t('section', 'wall', 1), &
      length_name_t('section', 'inner_diameter', 1), length_name_t('section', 'area', 2), &
      length_name_t('section', 'inertia', 4), length_name_t('section', 'outer_fibre', 1), length_name_t('mesh', 'nodes', 1)]

contains

   !> The same in SI and in millimetres, tonnes and seconds, with lengths, modulus and density at random.
   subroutine compare_units(number, draft, scene, accumulator, complaint)
      !> Which scene
      integer, intent(in) :: number
      !> It in ratios, and as it was read
      type(draft_t), intent(in) :: draft
      type(scene_t), intent(in) :: scene
      type(unit_tally_t), intent(inout) :: accumulator
      !> What differs; empty: nothing
      character(:), allocatable, intent(out) :: complaint

      character(*), parameter :: systems(2) = [character(6) :: 'SI', 'mm_t_s']
      type(draft_t) :: in_units
      type(scene_t) :: other
      real(wp) :: stiffest
      type(response_t), allocatable :: first, second
      character(:), allocatable :: words
      integer :: k
      logical :: is_read

      complaint = ''
      call respond(scene, first)
      if (.not. allocated(first)) return
      do k = 1, size(systems)
         call write_in_units(draft, number, systems(k), in_units)
         call read_all(in_units, other, is_read)
         if (.not. is_read) cycle
         call give_units(other, in_units)
         ! it says the same as the unit of displacement
         if (scene%start%kind /= start_release) call drop(in_units, 'stop', 'initial_height')
         call read_all(in_units, other, is_read)
         if (.not. is_read) cycle
         call respond(other, second)
         if (.not. allocated(second)) cycle
         stiffest = 0.0_wp
         if (allocated(scene%supports)) stiffest = maxval([0.0_wp, scene%supports%stiffness_ratio])
         call compare(first, second, scene%response, stiffest, accumulator, words)
         if (words /= '') complaint = complaint//trim(systems(k))//': '//words
      end do
   end subroutine compare_units

   !> Read a draft that may be too large for what the table allows.
   subroutine read_all(draft, scene, is_read)
      type(draft_t), intent(inout) :: draft
      type(scene_t), intent(out) :: scene
      !> With all its names
      logical, intent(out) :: is_read

      character(:), allocatable :: words
      integer :: names

      names = draft%count
      call settle(draft, scene, words)
      is_read = words == '' .and. draft%count == names
   end subroutine read_all

   subroutine respond(scene, response)
      type(scene_t), intent(in) :: scene
      !> Unallocated: it fails
      type(response_t), allocatable, intent(out) :: response

      type(beam_model_t) :: model
      type(analysed_t), allocatable :: analysed(:)
      type(frequency_table_t), allocatable :: table
      type(failure_t), allocatable :: error

      call compute_scene(scene, model, table, response, analysed, error)
      if (allocated(error) .and. allocated(response)) deallocate (response)
   end subroutine respond

   !> Lengths, modulus and density; what is a ratio stays one.
   subroutine write_in_units(draft, number, system, in_units)
      type(draft_t), intent(in) :: draft
      integer, intent(in) :: number
      character(*), intent(in) :: system
      type(draft_t), intent(out) :: in_units

      type(random_t) :: random
      type(length_name_t) :: one
      real(wp) :: length, u(3)
      integer :: i

      call start_random(number, 1, random)
      do i = 1, size(u)
         call next_random(random, u(i))
      end do
      length = 10.0_wp**(2.0_wp*u(1) - 2.0_wp)
      if (system == 'mm_t_s') length = 1.0e3_wp*length
      in_units = draft
      do i = 1, size(length_names)
         one = length_names(i)
         if (has_name(draft, trim(one%group), trim(one%name))) call put(in_units, trim(one%group), &
            trim(one%name), scaled(trim(value_of(draft, trim(one%group), trim(one%name))), length**one%power))
      end do
      if (.not. has_name(draft, 'beam', 'length')) call put(in_units, 'beam', 'length', to_text(length))
      call put(in_units, 'beam', 'youngs_modulus', to_text(10.0_wp**(9.0_wp + 2.5_wp*u(2)) &
         *merge(1.0e-6_wp, 1.0_wp, system == 'mm_t_s')))
      call put(in_units, 'beam', 'density', to_text(1.0e3_wp*(1.0_wp + 10.0_wp*u(3)) &
         *merge(1.0e-12_wp, 1.0_wp, system == 'mm_t_s')))
   end subroutine write_in_units

   !> Numbers, each times a factor.
   function scaled(values, factor) result(text)
      character(*), intent(in) :: values
      real(wp), intent(in) :: factor
      character(:), allocatable :: text

      real(wp), allocatable :: number(:)
      integer :: i

      allocate (number(1 + count([(values(i:i) == ',', i=1, len(values))])))
      read (values, *) number
      text = ''
      do i = 1, size(number)
         if (i > 1) text = text//', '
         text = text//to_text(number(i)*factor)
      end do
   end function scaled

   !> Events, until rounding has grown; where they are the same to the end, measures and statistics.
   subroutine compare(first, second, settings, stiffest, accumulator, complaint)
      type(response_t), intent(in) :: first
      type(response_t), intent(in) :: second
      !> Of both
      type(response_settings_t), intent(in) :: settings
      !> Greatest stiffness ratio of a support
      real(wp), intent(in) :: stiffest
      type(unit_tally_t), intent(inout) :: accumulator
      !> What differs; empty: nothing
      character(:), allocatable, intent(out) :: complaint

      !> The motion amplifies its rounding, and what is told of it that of the motion
      real(wp), parameter :: rounding = 1.0e-12_wp, amplified = 1.0e3_wp
      !> From here on events are those of another motion
      real(wp), parameter :: grown = 1.0e-3_wp
      real(wp) :: apart, extent
      integer :: i, row, same

      complaint = ''
      accumulator%scenes = accumulator%scenes + 1
      apart = rounding
      same = 0
      do i = 1, min(first%event_count, second%event_count)
         associate (a => first%events(i), b => second%events(i))
            if (a%kind /= b%kind .or. a%contact /= b%contact) exit
            apart = max(apart, abs(a%tau - b%tau)/(1.0_wp + a%tau), abs(a%velocity_before - b%velocity_before), &
               abs(a%velocity_after - b%velocity_after))
            same = i
         end associate
      end do
      if (same < max(first%event_count, second%event_count)) then
         ! what rounding has become tells whether a low flight is taken back, or is all that is left
         if (apart > min(grown, settings%hop_tolerance) .or. max(speed_after(first), &
            speed_after(second)) <= amplified*apart) return
         complaint = 'the event after '//to_text(same)//' of '//to_text(first%event_count)//' and '// &
            to_text(second%event_count)//' is another, though those before are apart by '//to_text(apart)//'; '
         return
      end if
      if (apart > grown) return
      accumulator%whole = accumulator%whole + 1
      accumulator%events = accumulator%events + same
      extent = 1.0_wp + maxval([0.0_wp, abs(first%contacts%height)])
      associate (a => first%statistics, b => second%statistics)
         do i = 1, size(a%value, 1)
            row = first_statistic + i - 1
            call check(row, '', a%value(i, :), b%value(i, :), abs(a%value(i, :)))
            call check(row, 'bars of ', a%half_width(i, :), b%half_width(i, :), abs(a%value(i, :)))
         end do
      end associate
      associate (a => row_of(first%measures), b => row_of(second%measures))
         do i = 1, first_statistic - 1
            ! of peaks as high as each other rounding chooses one
            if (any(measure_table(i)%name == [character(24) :: 'greatest_stress_time', 'greatest_stress_position', &
               'strongest_frequency', 'force_lasts', 'stress_cycles', 'equivalent_range'])) cycle
            ! what a run as short as this changes of a signal, its mean removed, is rounding
            if (index(measure_table(i)%name, 'strongest') == 1 .and. settings%duration < 1.0e-6_wp) cycle
            call check(i, '', a([i]), b([i]), abs(a([i])))
         end do
      end associate

   contains

      !> The greatest velocity of the events after those that are the same.
      function speed_after(response) result(speed)
         type(response_t), intent(in) :: response
         real(wp) :: speed

         speed = 0.0_wp
         if (response%event_count == same) return
         associate (events => response%events(same + 1:response%event_count))
            speed = max(maxval(abs(events%velocity_before)), maxval(abs(events%velocity_after)))
         end associate
      end function speed_after

      !> Numbers that should be the same.
      subroutine check(row, what, a, b, size_of)
         !> Of the table of measures
         integer, intent(in) :: row
         !> What of them
         character(*), intent(in) :: what
         real(wp), intent(in) :: a(:)
         real(wp), intent(in) :: b(:)
         !> How large is what they are made of?
         real(wp), intent(in) :: size_of(:)

         character(*), parameter :: sought(6) = [character(8) :: 'maximum', 'minimum', 'greatest', 'stress', 'peak', &
            'range']
         character(24) :: name, quantity
         real(wp) :: tolerance
         integer :: k

         name = measure_table(row)%name
         quantity = measure_table(row)%quantity
         tolerance = amplified*apart
         if (any([(index(name, trim(sought(k))) > 0, k=1, size(sought))])) tolerance = max(tolerance, &
            3.0_wp*first%measures%extremes_tolerance)
         ! Newmark's reactions are made of forces of the shortest element, and those of rounding
         if (settings%method /= method_exact .and. any(quantity == [character(7) :: 'force', 'impulse', 'moment', 'stress'])) &
            tolerance = max(tolerance, 1.0e-5_wp)
         ! so are accelerations: one unit in the last place of a node changes some of them by 3e-10, and a support makes
         ! a force from the last place of its displacement
         if (quantity == 'acceleration') tolerance = max(tolerance, 1.0e-8_wp, epsilon(1.0_wp)*stiffest)
         do k = 1, size(a)
            if (ieee_is_nan(a(k)) .and. ieee_is_nan(b(k))) cycle
            if (abs(a(k) - b(k)) <= tolerance*max(size_of(k), floor_of(quantity))) cycle
            complaint = complaint//what//trim(name)//' '//to_text(a(k))//' becomes '//to_text(b(k))//', events are apart by ' &
               //to_text(apart)//'; '
         end do
      end subroutine check

      !> What a quantity is at least a difference of.
      pure function floor_of(quantity) result(least)
         character(*), intent(in) :: quantity
         real(wp) :: least

         select case (quantity)
         case ('number', 'velocity', 'displacement', 'moment', 'stress')
            least = extent
         case ('time')
            least = first%measures%duration
         case ('force')
            least = 1.0e-3_wp*extent
         case ('impulse')
            least = extent*first%measures%duration
         case default
            least = 0.0_wp
         end select
      end function floor_of
   end subroutine compare

end module unit_checks
